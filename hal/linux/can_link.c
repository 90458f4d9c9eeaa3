#include "can_link.h"

#include <errno.h>
#include <linux/can/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#define REPLY_MAX 16384
#define REPLY_TIMEOUT_US 200000 /* the kernel answers within the send; this is for when it does not */

int can_link_open(void)
{
    int fd = socket(AF_NETLINK, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, NETLINK_ROUTE);
    if (fd < 0) {
        return -1;
    }
    struct sockaddr_nl address = {.nl_family = AF_NETLINK, .nl_groups = RTMGRP_LINK};
    if (bind(fd, (const struct sockaddr *)&address, sizeof address) != 0) {
        int reason = errno;
        close(fd);
        errno = reason;
        return -1;
    }
    return fd;
}

void can_link_drain(int link_fd)
{
    char byte;
    /* ENOBUFS: news was lost, more may wait. */
    while (recv(link_fd, &byte, sizeof byte, MSG_DONTWAIT) >= 0 || errno == ENOBUFS) {
    }
}

bool can_link_find(int link_fd, const char *name, can_link_t *link)
{
    struct ifreq request = {0};
    strncpy(request.ifr_name, name, sizeof request.ifr_name - 1);
    if (ioctl(link_fd, SIOCGIFINDEX, &request) != 0) {
        return false;
    }
    link->index = request.ifr_ifindex;
    if (ioctl(link_fd, SIOCGIFFLAGS, &request) != 0) {
        return false;
    }
    link->up = (request.ifr_flags & IFF_UP) != 0;
    if (ioctl(link_fd, SIOCGIFHWADDR, &request) != 0) {
        return false;
    }
    link->is_can = request.ifr_hwaddr.sa_family == ARPHRD_CAN;
    return true;
}

/* The attribute of this type among size bytes of attributes, or NULL. */
static const struct rtattr *find_attribute(const struct rtattr *attributes, size_t size, unsigned type)
{
    const char *at = (const char *)attributes;
    while (size >= sizeof(struct rtattr)) {
        const struct rtattr *attribute = (const struct rtattr *)(const void *)at;
        size_t step = RTA_ALIGN((size_t)attribute->rta_len);
        if (attribute->rta_len < sizeof *attribute || attribute->rta_len > size) {
            return NULL;
        }
        if ((attribute->rta_type & NLA_TYPE_MASK) == type) {
            return attribute;
        }
        at += step;
        size = step < size ? size - step : 0;
    }
    return NULL;
}

static const struct rtattr *find_nested(const struct rtattr *outer, unsigned type)
{
    return outer == NULL ? NULL : find_attribute(RTA_DATA(outer), RTA_PAYLOAD(outer), type);
}

static uint8_t counter(unsigned value)
{
    return (uint8_t)(value > UINT8_MAX ? UINT8_MAX : value);
}

static hal_can_state_t state_of(uint32_t kernel_state)
{
    switch (kernel_state) {
    case CAN_STATE_ERROR_PASSIVE:
        return HAL_CAN_PASSIVE;
    case CAN_STATE_BUS_OFF:
        return HAL_CAN_BUS_OFF;
    default:
        return HAL_CAN_ACTIVE;
    }
}

static void read_health(const struct nlmsghdr *reply, size_t size, hal_can_health_t *health)
{
    if (!NLMSG_OK(reply, size) || reply->nlmsg_type != RTM_NEWLINK) {
        return;
    }
    const struct rtattr *info =
        find_attribute(IFLA_RTA(NLMSG_DATA(reply)), IFLA_PAYLOAD(reply), IFLA_LINKINFO);
    const struct rtattr *data = find_nested(info, IFLA_INFO_DATA);
    const struct rtattr *state = find_nested(data, IFLA_CAN_STATE);
    if (state != NULL && RTA_PAYLOAD(state) >= sizeof(uint32_t)) {
        uint32_t value;
        memcpy(&value, RTA_DATA(state), sizeof value);
        health->state = state_of(value);
    }
    const struct rtattr *counters = find_nested(data, IFLA_CAN_BERR_COUNTER);
    struct can_berr_counter errors;
    if (counters != NULL && RTA_PAYLOAD(counters) >= sizeof errors) {
        memcpy(&errors, RTA_DATA(counters), sizeof errors);
        health->tx_errors = counter(errors.txerr);
        health->rx_errors = counter(errors.rxerr);
    }
}

void can_link_health(int index, hal_can_health_t *health)
{
    health->state = HAL_CAN_ACTIVE;
    health->tx_errors = 0;
    health->rx_errors = 0;
    int fd = socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
    if (fd < 0) {
        return;
    }
    struct timeval limit = {.tv_usec = REPLY_TIMEOUT_US};
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    struct {
        struct nlmsghdr header;
        struct ifinfomsg link;
    } request = {
        .header = {.nlmsg_len = sizeof request, .nlmsg_type = RTM_GETLINK, .nlmsg_flags = NLM_F_REQUEST},
        .link = {.ifi_index = index}};
    union {
        struct nlmsghdr header;
        char bytes[REPLY_MAX];
    } reply;
    if (send(fd, &request, sizeof request, 0) == (ssize_t)sizeof request) {
        ssize_t size = recv(fd, &reply, sizeof reply, 0);
        if (size > 0) {
            read_health(&reply.header, (size_t)size, health);
        }
    }
    close(fd);
}

void can_link_restart(int link_fd, int index)
{
    /* Attributes within attributes; each length counts what is inside. All sizes are multiples of four. */
    struct {
        struct nlmsghdr header;
        struct ifinfomsg link;
        struct rtattr info;
        struct rtattr kind;
        char kind_name[4];
        struct rtattr data;
        struct rtattr restart;
        uint32_t restart_value;
    } request = {
        .header = {.nlmsg_len = sizeof request, .nlmsg_type = RTM_NEWLINK, .nlmsg_flags = NLM_F_REQUEST},
        .link = {.ifi_index = index},
        .info = {.rta_type = IFLA_LINKINFO,
                 .rta_len = 4 * sizeof(struct rtattr) + sizeof request.kind_name + sizeof(uint32_t)},
        .kind = {.rta_type = IFLA_INFO_KIND, .rta_len = sizeof(struct rtattr) + sizeof request.kind_name},
        .kind_name = "can",
        .data = {.rta_type = IFLA_INFO_DATA, .rta_len = 2 * sizeof(struct rtattr) + sizeof(uint32_t)},
        .restart = {.rta_type = IFLA_CAN_RESTART, .rta_len = sizeof(struct rtattr) + sizeof(uint32_t)},
        .restart_value = 1};
    send(link_fd, &request, sizeof request, MSG_DONTWAIT);
}
