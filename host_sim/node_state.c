#include "node_state.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

void node_state_blank(pdcp_device_record_t *record)
{
    memset(record, 0, sizeof *record);
    for (unsigned i = 0; i < PDCP_DEVICE_CHANNELS_MAX; i++) {
        record->sources[i].identity.vid = PDCP_NO_SOURCE_WORD;
        record->sources[i].identity.pid = PDCP_NO_SOURCE_WORD;
        record->sources[i].identity.sn = PDCP_NO_SOURCE_WORD;
        record->sources[i].channel = PDCP_NO_SOURCE_INDEX;
    }
}

static bool take_node_id(const char *line, pdcp_device_record_t *record)
{
    unsigned id;
    int end = 0;
    if (sscanf(line, "node_id %u%n", &id, &end) != 1 || line[end] != '\0' || id > PDCP_NODE_MAX) {
        return false;
    }
    record->node_id = (uint8_t)id;
    return true;
}

static bool take_source(const char *line, pdcp_device_record_t *record)
{
    unsigned channel;
    unsigned index;
    unsigned words[5]; /* VID, PID, SN, type, profile */
    int end = 0;
    if (sscanf(line, "source %u %x %x %x %u %x %x%n", &channel, &words[0], &words[1], &words[2], &index,
               &words[3], &words[4], &end) != 7 ||
        line[end] != '\0' || channel < 1 || channel > PDCP_DEVICE_CHANNELS_MAX || index > 0xFF) {
        return false;
    }
    for (unsigned i = 0; i < 5; i++) {
        if (words[i] > 0xFFFF) {
            return false;
        }
    }
    pdcp_device_source_t *source = &record->sources[channel - 1];
    source->identity.vid = (uint16_t)words[0];
    source->identity.pid = (uint16_t)words[1];
    source->identity.sn = (uint16_t)words[2];
    source->channel = (uint8_t)index;
    source->type = (uint16_t)words[3];
    source->profile = (uint16_t)words[4];
    return true;
}

bool node_state_load(const char *path, pdcp_device_record_t *record, char *error, size_t error_size)
{
    char line[128];
    FILE *file = fopen(path, "re");
    bool good = true;
    node_state_blank(record);
    if (file == NULL) {
        if (errno == ENOENT) {
            return true;
        }
        (void)snprintf(error, error_size, "%s: %s", path, strerror(errno));
        return false;
    }
    for (unsigned number = 1; good && fgets(line, sizeof line, file) != NULL; number++) {
        line[strcspn(line, "\r\n")] = '\0';
        good = line[0] == '\0' || take_node_id(line, record) || take_source(line, record);
        if (!good) {
            (void)snprintf(error, error_size, "%s:%u: neither node_id nor source", path, number);
        }
    }
    if (good && ferror(file) != 0) {
        (void)snprintf(error, error_size, "%s: %s", path, strerror(errno));
        good = false;
    }
    (void)fclose(file);
    return good;
}

static bool write_all(FILE *file, const pdcp_device_record_t *record, uint8_t channel_count)
{
    bool good = fprintf(file, "node_id %u\n", record->node_id) > 0;
    for (uint8_t i = 0; i < channel_count && good; i++) {
        const pdcp_device_source_t *source = &record->sources[i];
        if (pdcp_device_source_connected(source)) {
            good = fprintf(file, "source %u %04X %04X %04X %u %04X %04X\n", i + 1u, source->identity.vid,
                           source->identity.pid, source->identity.sn, source->channel, source->type,
                           source->profile) > 0;
        }
    }
    return fclose(file) == 0 && good;
}

bool node_state_save(const char *path, const pdcp_device_record_t *record, uint8_t channel_count)
{
    char *beside = NULL;
    if (asprintf(&beside, "%s.new", path) < 0) {
        errno = ENOMEM;
        return false;
    }
    FILE *file = fopen(beside, "we");
    const bool good = file != NULL && write_all(file, record, channel_count) && rename(beside, path) == 0;
    if (file != NULL && !good) {
        const int reason = errno;
        (void)unlink(beside);
        errno = reason;
    }
    free(beside);
    return good;
}
