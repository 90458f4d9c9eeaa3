#include "node_ini_reader.h"

#include <stdarg.h>
#include <stdlib.h>

bool node_ini_reader_fail(node_ini_reader_t *reader, int line, const char *format, ...)
{
    if (reader->failed) {
        return false;
    }
    reader->failed = true;
    const int used = snprintf(reader->error, reader->error_size, "%s:%d: ", reader->path, line);
    if (used > 0 && (size_t)used < reader->error_size) {
        va_list args;
        va_start(args, format);
        (void)vsnprintf(&reader->error[used], reader->error_size - (size_t)used, format, args);
        va_end(args);
    }
    return false;
}

bool node_ini_reader_out_of_memory(node_ini_reader_t *reader)
{
    return node_ini_reader_fail(reader, reader->line, "out of memory");
}

void node_ini_reader_clear(node_ini_reader_t *reader)
{
    for (unsigned i = 0; i < PDCP_DEVICE_CHANNELS_MAX; i++) {
        free(reader->drafts[i].signal.text);
        free(reader->drafts[i].needs[0].text);
        free(reader->drafts[i].needs[1].text);
    }
}
