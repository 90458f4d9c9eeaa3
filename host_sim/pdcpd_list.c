#include "pdcpd_list.h"

#include <dirent.h>
#include <net/if_arp.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "can_gs_usb.h"

#define NET_FOLDER "/sys/class/net"
#define TTY_FOLDER "/sys/class/tty"

enum { PATH_BYTES = 512, TEXT_BYTES = 128, LEVELS_TO_USB = 3, NAME_WIDTH = 28 };

/* The first line of a small file without its end; false and "": there is none. */
static bool read_line(const char *path, char text[TEXT_BYTES])
{
    FILE *file = fopen(path, "re");
    text[0] = '\0';
    if (file == NULL) {
        return false;
    }
    const bool read = fgets(text, TEXT_BYTES, file) != NULL;
    (void)fclose(file);
    text[strcspn(text, "\n")] = '\0';
    return read;
}

static void print(FILE *out, const char *option, const char *kind, const char *name, const char *description)
{
    const int width = NAME_WIDTH - (int)strlen(kind);
    (void)fprintf(out, "%-5s %s%-*s %s\n", option, kind, width, name, description);
}

static void on_adapter(void *ctx, const char *name, const char *description)
{
    print(ctx, "can", "", name, description);
}

static void list_interface(FILE *out, const char *name)
{
    char path[PATH_BYTES];
    char text[TEXT_BYTES];
    (void)snprintf(path, sizeof path, NET_FOLDER "/%s/type", name);
    if (!read_line(path, text) || strtol(text, NULL, 10) != ARPHRD_CAN) {
        return;
    }
    (void)snprintf(path, sizeof path, NET_FOLDER "/%s/flags", name);
    const bool up = read_line(path, text) && (strtoul(text, NULL, 16) & 1u) != 0;
    print(out, "can", "socketcan:", name,
          up ? "interface of the kernel, up" : "interface of the kernel, down");
}

/* A USB adapter's name stands some folders above its line. */
static void describe_line(const char *name, char text[TEXT_BYTES])
{
    char path[PATH_BYTES];
    char up[] = "../../..";
    for (size_t level = 1; level <= LEVELS_TO_USB; level++) {
        (void)snprintf(path, sizeof path, TTY_FOLDER "/%s/device/%.*s/product", name, (int)(3 * level - 1),
                       up);
        if (read_line(path, text)) {
            return;
        }
    }
    (void)snprintf(text, TEXT_BYTES, "serial line");
}

static void list_line(FILE *out, const char *name)
{
    char path[PATH_BYTES];
    char text[TEXT_BYTES];
    (void)snprintf(path, sizeof path, TTY_FOLDER "/%s/device", name);
    if (access(path, F_OK) != 0) {
        return; /* a terminal, not a line */
    }
    (void)snprintf(path, sizeof path, TTY_FOLDER "/%s/type", name);
    if (read_line(path, text) && strcmp(text, "0") == 0) {
        return; /* the driver keeps a place for a UART that this machine does not have */
    }
    (void)snprintf(path, sizeof path, "/dev/%s", name);
    describe_line(name, text);
    print(out, "host", "serial:", path, text);
}

static void list_folder(FILE *out, const char *folder, void (*list_one)(FILE *out, const char *name))
{
    struct dirent **entries;
    const int n = scandir(folder, &entries, NULL, alphasort);
    for (int i = 0; i < n; i++) {
        if (entries[i]->d_name[0] != '.') {
            list_one(out, entries[i]->d_name);
        }
        free(entries[i]);
    }
    if (n >= 0) {
        free(entries);
    }
}

void pdcpd_list(FILE *out)
{
    can_gs_usb_list(on_adapter, out);
    list_folder(out, NET_FOLDER, list_interface);
    list_folder(out, TTY_FOLDER, list_line);
}
