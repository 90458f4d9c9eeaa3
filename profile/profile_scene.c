#include "profile_scene.h"

#include "profile_channel.h"

/* A device that is being set up is away for a moment only (D-PRO-13). */
bool profile_scene_is_awaited(const profile_scene_t *scene, const profile_ref_t *end)
{
    const uint8_t place = profile_links_place(scene->links, scene->tables, end);
    if (place == PDCP_NONE) {
        return false;
    }
    const pdcp_device_entry_t *device = &scene->tables->devices[place];
    if (device->state == PDCP_PLACE_LOST) {
        return pdcp_bit(scene->awaited, place);
    }
    return device->state == PDCP_PLACE_SETUP && !device->setup_again;
}

bool profile_scene_is_banned(const profile_scene_t *scene, uint8_t output, uint8_t input)
{
    const profile_pair_t *banned = scene->banned;
    for (uint8_t i = scene->banned_count; i > 0; i--, banned++) {
        if (banned->output == output && banned->input == input) {
            return true;
        }
    }
    return false;
}

uint8_t profile_scene_source(const profile_scene_t *scene, uint8_t input)
{
    const uint8_t source = profile_channel_source(scene->tables, input);
    if (!profile_channel_is_ready(scene->tables, source, PDCP_OUTPUT) || pdcp_bit(scene->made, input)) {
        return PDCP_NONE;
    }
    return source;
}
