/* Capacities of the device role; those of its queue and messages stand in pdcp_limits.h. */
#ifndef PDCP_DEVICE_LIMITS_H
#define PDCP_DEVICE_LIMITS_H

/* Channels of one device, 1 to 254. A larger or smaller device defines its own number
 * (-DPDCP_DEVICE_CHANNELS_MAX=8). */
#ifndef PDCP_DEVICE_CHANNELS_MAX
#define PDCP_DEVICE_CHANNELS_MAX 32
#endif

/* Places of the queue that only answers may take, so that channel data never keep one out. */
#define PDCP_DEVICE_ANSWERS_MAX 4

#endif
