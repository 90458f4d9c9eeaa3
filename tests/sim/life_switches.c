#include <string.h>

#include "life.h"

static struct {
    const char *name;
    bool holds; /* lives hold with it: it belongs to every run of the tests */
    bool on;
} switches[LIFE_SWITCHES] = {
    [LIFE_VALUES] = {"values", true, false},
    [LIFE_FLAGS] = {"flags", true, false},
    [LIFE_TWINS] = {"twins", true, false},
    [LIFE_CLONES_COME] = {"clones", false, false}, /* what a twin leaves behind */
    [LIFE_LOOSE_PLUGS] = {"loose", true, false},
    [LIFE_LOST_FRAMES] = {"lost", true, false},
    [LIFE_RESTARTS] = {"restarts", false, false}, /* D-BUS-33: ids of devices that were not heard yet */
    [LIFE_FORGED_FLAGS] = {"enabled", true, false},
    [LIFE_FORGED_SOURCES] = {"source", true, false},
    [LIFE_FORGED_SUSPENDS] = {"suspend", false, false}, /* D-BUS-32 */
    [LIFE_FORGED_RESETS] = {"reset", true, false},
    [LIFE_UNKNOWN_BEACONS] = {"unknown", true, false},
    [LIFE_FOREIGN_BEACONS] = {"foreign", true, false},
};

bool life_is_on(int number)
{
    return switches[number].on;
}

static bool is_listed(const char *list, const char *name)
{
    const size_t len = strlen(name);
    for (const char *at = strstr(list, name); at != NULL; at = strstr(at + 1, name)) {
        if ((at == list || at[-1] == ',') && (at[len] == ',' || at[len] == '\0')) {
            return true;
        }
    }
    return false;
}

void life_switch_on(const char *list)
{
    for (int i = 0; i < LIFE_SWITCHES; i++) {
        switches[i].on = is_listed(list, "all") || is_listed(list, switches[i].name) ||
                         (is_listed(list, "held") && switches[i].holds);
    }
}
