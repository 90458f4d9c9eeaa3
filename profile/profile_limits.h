/* Capacities of the profile layer; those of the bus stand in pdcp_limits.h. A larger part may define its own
 * (-DPROFILE_LINKS_MAX=100). */
#ifndef PROFILE_LIMITS_H
#define PROFILE_LIMITS_H

#ifndef PROFILE_LINKS_MAX
#define PROFILE_LINKS_MAX 48 /* links of the active configuration, 1 to 254 (D-PRO-11) */
#endif

#ifndef PROFILE_PARTS_MAX
#define PROFILE_PARTS_MAX 40 /* devices that these links name, 2 to 254 */
#endif

#define PROFILE_BANNED_MAX 8 /* refused or unanswered links that are not planned for now, 1 to 255 */

#endif
