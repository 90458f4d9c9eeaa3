#include "pdcp_step.h"

#include "pdcp_bind.h"
#include "pdcp_bytes.h"
#include "pdcp_codec.h"
#include "pdcp_ends.h"

/* The parameter that each step reads or writes. */
static const uint8_t params[PDCP_STEP_END] = {
    [PDCP_STEP_READ_VID_PID] = PDCP_IN_SOURCE_VID_PID,
    [PDCP_STEP_READ_SERIAL] = PDCP_IN_SOURCE_SERIAL,
    [PDCP_STEP_OUTPUT_ID] = PDCP_OUT_NODE_ID,
    [PDCP_STEP_INPUT_OFF] = PDCP_CH_ENABLED,
    [PDCP_STEP_VID_PID] = PDCP_IN_SOURCE_VID_PID,
    [PDCP_STEP_SERIAL] = PDCP_IN_SOURCE_SERIAL,
    [PDCP_STEP_TYPE] = PDCP_IN_SOURCE_TYPE,
    [PDCP_STEP_NODES] = PDCP_IN_SOURCE_NODES,
    [PDCP_STEP_INPUT_ON] = PDCP_CH_ENABLED,
    [PDCP_STEP_OUTPUT_ID_AGAIN] = PDCP_OUT_NODE_ID,
    [PDCP_STEP_OUTPUT_ON] = PDCP_CH_ENABLED,
};

static bool is_about_output(uint8_t step)
{
    return step >= PDCP_STEP_OUTPUT_ID_AGAIN || step == PDCP_STEP_OUTPUT_ID;
}

/* The channel that the current step is about. */
static uint8_t target_of(const pdcp_job_t *job)
{
    return is_about_output(job->step) ? job->output : job->input;
}

pdcp_channel_t *pdcp_step_channel(pdcp_bus_t *bus)
{
    return pdcp_ends_channel(bus, target_of(&bus->link.job));
}

static bool has_id(const pdcp_bus_t *bus, uint8_t output)
{
    return output != PDCP_NONE && bus->tables.channels[output].node_id != 0;
}

/* Is the output there that the current step needs, with a node id or, in the step that gives it one, one to
 * be had? */
static bool has_output(pdcp_bus_t *bus)
{
    const uint8_t output = bus->link.job.output;
    const bool is_giving = bus->link.job.step == PDCP_STEP_OUTPUT_ID;
    return pdcp_ends_is_ready(bus, output) &&
           (has_id(bus, output) || (is_giving && pdcp_bind_output_id(bus) != 0));
}

/* Can the current step be carried out? Making a link needs its input in every step. */
static bool is_possible(pdcp_bus_t *bus)
{
    const pdcp_job_t *job = &bus->link.job;
    if (job->undoing) {
        return pdcp_ends_is_ready(bus, target_of(job));
    }
    if ((is_about_output(job->step) || job->step == PDCP_STEP_NODES) && !has_output(bus)) {
        return false;
    }
    return pdcp_ends_is_ready(bus, job->input);
}

/* Puts what the tables say of an input's source, parameter 5, 6 or 8. Returns the value's length. */
static uint8_t put_source(const pdcp_channel_t *input, uint8_t param, uint8_t *bytes)
{
    uint16_t low = input->source.type;
    uint16_t high = input->source.profile;
    if (param == PDCP_IN_SOURCE_VID_PID) {
        low = input->source.identity.vid;
        high = input->source.identity.pid;
    } else if (param == PDCP_IN_SOURCE_SERIAL) {
        low = input->source.identity.sn;
        high = input->source.index;
    }
    pdcp_bytes_put_u16(&bytes[0], low);
    pdcp_bytes_put_u16(&bytes[2], high);
    return param == PDCP_IN_SOURCE_SERIAL ? 3 : 4;
}

/* Does the current step enable the channel that it is about? */
static bool is_enabling(const pdcp_job_t *job)
{
    return (job->step == PDCP_STEP_INPUT_ON || job->step == PDCP_STEP_OUTPUT_ON) && !job->undoing;
}

/* Has the current step something to write to this channel? Only a link that is written again writes the
 * output's node id once more before it enables the output (D-BUS-57). */
static bool has_value(const pdcp_job_t *job, const pdcp_channel_t *channel)
{
    switch ((pdcp_step_t)job->step) {
    case PDCP_STEP_INPUT_OFF:
        return channel->enabled;
    case PDCP_STEP_OUTPUT_ID_AGAIN:
        return job->kind == PDCP_TODO_WRITE;
    case PDCP_STEP_OUTPUT_ON:
        return !job->output_was_on;
    default:
        return true;
    }
}

/* Puts the value that the current step writes. Returns its length. */
static uint8_t put_value(pdcp_bus_t *bus, uint8_t *bytes)
{
    const pdcp_job_t *job = &bus->link.job;
    const pdcp_channel_t *output = pdcp_ends_channel(bus, job->output);
    const uint8_t param = params[job->step];
    uint16_t word = 0;
    uint8_t len = 1;
    if (param == PDCP_CH_ENABLED) {
        word = is_enabling(job) ? 1 : 0;
    } else if (is_about_output(job->step)) {
        word = output->node_id;
    } else if (param == PDCP_IN_SOURCE_NODES) {
        word = job->undoing
                   ? 0
                   : pdcp_codec_node_ids(pdcp_bus_device(bus, output->place)->node_id, output->node_id);
        len = 2;
    } else {
        return put_source(pdcp_ends_channel(bus, job->input), param, bytes);
    }
    pdcp_bytes_put_u16(bytes, word);
    return len;
}

/* From now on the device may have what is being written to it, whether it answers or not. */
static void expect_effect(pdcp_bus_t *bus, pdcp_channel_t *channel)
{
    const pdcp_job_t *job = &bus->link.job;
    if (is_enabling(job)) {
        channel->enabled = true;
    } else if (job->step == PDCP_STEP_NODES && !job->undoing) {
        channel->node_id = bus->tables.channels[job->output].node_id; /* it may listen to it */
    }
}

/* Sends the request of the current step, which concerns this channel. False: there is nothing to write in
 * it. */
static bool send_request(pdcp_bus_t *bus, pdcp_channel_t *channel)
{
    const pdcp_job_t *job = &bus->link.job;
    const uint8_t param = params[job->step];
    uint8_t bytes[PDCP_VALUE_MAX];
    if (pdcp_step_is_reading(job->step)) {
        pdcp_request_get(bus, channel->place, PDCP_CLIENT_LINK, channel->index, param, PDCP_VALUE_MAX);
        return true;
    }
    if ((job->step == PDCP_STEP_OUTPUT_ID && !pdcp_bind_give_output_id(bus, channel)) ||
        !has_value(job, channel)) {
        return false;
    }
    expect_effect(bus, channel);
    const uint8_t len = put_value(bus, bytes);
    pdcp_request_set(bus, channel->place, PDCP_CLIENT_LINK, channel->index, param, bytes, len);
    if (job->once) {
        pdcp_request_limit_tries(bus, channel->place, 1);
    }
    return true;
}

/* An output is not enabled in the arbitrator's first time (D-BUS-36). */
static bool is_too_early(const pdcp_bus_t *bus)
{
    const pdcp_job_t *job = &bus->link.job;
    return bus->link.closed && job->step == PDCP_STEP_OUTPUT_ON && !job->undoing;
}

pdcp_step_result_t pdcp_step_send(pdcp_bus_t *bus)
{
    const pdcp_job_t *job = &bus->link.job;
    pdcp_channel_t *channel = pdcp_step_channel(bus);
    if (!is_possible(bus)) {
        return PDCP_STEP_IMPOSSIBLE;
    }
    if (job->step == PDCP_STEP_OUTPUT_ID && channel->node_id != 0) {
        return PDCP_STEP_NOTHING;
    }
    if (!pdcp_request_is_idle(bus, channel->place) || is_too_early(bus)) {
        return PDCP_STEP_LATER;
    }
    return send_request(bus, channel) ? PDCP_STEP_SENT : PDCP_STEP_NOTHING;
}

bool pdcp_step_take(pdcp_bus_t *bus, const pdcp_reply_t *reply)
{
    const pdcp_job_t *job = &bus->link.job;
    pdcp_channel_t *channel = pdcp_step_channel(bus);
    if (pdcp_step_is_reading(job->step)) {
        const uint16_t low = pdcp_request_word(reply, 0);
        const uint16_t high = pdcp_request_word(reply, 2);
        if (job->kind != PDCP_TODO_UPDATE) {
            return pdcp_tables_is_source(channel, reply->param, low, high);
        }
        pdcp_tables_take_source(channel, reply->param, low, high);
    } else if (job->step == PDCP_STEP_INPUT_OFF || (job->step >= PDCP_STEP_INPUT_ON && job->undoing)) {
        pdcp_ends_on_disabled(bus, channel);
    } else if (job->step == PDCP_STEP_NODES && job->undoing) {
        channel->node_id = 0;
    }
    return true;
}
