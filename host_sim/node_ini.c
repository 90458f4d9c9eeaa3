#include "node_ini.h"

#include <stdlib.h>

void node_ini_free(node_ini_t *ini)
{
    if (ini == NULL) {
        return;
    }
    for (unsigned i = 0; i < PDCP_DEVICE_CHANNELS_MAX; i++) {
        node_signal_clear(&ini->signals[i]);
        free(ini->texts[i + 1]);
    }
    for (unsigned i = 0; i < NODE_INI_EXTRAS_MAX; i++) {
        free(ini->extras[i].bytes);
    }
    free(ini->texts[0]);
    free(ini->desc.bulk);
    free(ini->state_path);
    free(ini);
}
