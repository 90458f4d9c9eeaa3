#include "pdcp_job.h"

#include <stddef.h>

#include "pdcp_assert.h"
#include "pdcp_bind.h"
#include "pdcp_ends.h"
#include "pdcp_step.h"

/* --- Beginning --- */

static void take_old(pdcp_job_t *job, const pdcp_channel_t *input)
{
    job->old = input->source;
    job->old_link = input->link;
}

static void give_back_old(const pdcp_job_t *job, pdcp_channel_t *input)
{
    input->source = job->old;
    input->source.channel = PDCP_NONE;
    input->link = job->old_link != PDCP_LINK_NONE ? PDCP_LINK_INACTIVE : PDCP_LINK_NONE; /* D-BUS-10 */
}

/* The tables name the job's output as the source of its input. */
static void name_source(pdcp_bus_t *bus, pdcp_channel_t *input)
{
    pdcp_job_t *job = &bus->link.job;
    const pdcp_channel_t *output = &bus->tables.channels[job->output];
    input->source = (pdcp_source_t){.identity = pdcp_bus_device(bus, output->place)->identity,
                                    .type = output->type,
                                    .profile = output->profile,
                                    .index = output->index,
                                    .channel = job->output};
    input->link = PDCP_LINK_INACTIVE;
    /* Enabled alone means only: may be. */
    job->output_was_on = pdcp_ends_listener(bus, job->output) != PDCP_NONE;
}

/* What takes away runs through all steps backwards, and leaves out those that its channels do not have. */
void pdcp_job_begin(pdcp_bus_t *bus, pdcp_todo_t kind, uint8_t input, uint8_t output)
{
    pdcp_job_t *job = &bus->link.job;
    bus->link.changed = true;
    job->active = true;
    job->at = PDCP_NONE;
    job->kind = (uint8_t)kind;
    job->input = input;
    job->output = output;
    job->step = PDCP_STEP_OUTPUT_ON;
    job->undoing = true;
    job->once = false;
    job->for_host = false;
    job->for_device = kind == PDCP_TODO_UPDATE;
    job->differs = false;
    job->output_was_on = false;
    job->status = PDCP_OK;
    pdcp_channel_t *channel = pdcp_ends_channel(bus, input);
    if (channel != NULL) {
        take_old(job, channel);
    }
    if (kind == PDCP_TODO_WRITE) {
        job->step = PDCP_STEP_VID_PID;
        job->undoing = false;
    } else if (kind == PDCP_TODO_UPDATE) {
        job->step = PDCP_STEP_READ_VID_PID;
        job->undoing = false;
    } else if (kind == PDCP_TODO_CONNECT) {
        job->step = PDCP_STEP_OUTPUT_ID;
        job->undoing = false;
        name_source(bus, channel);
    }
}

void pdcp_job_begin_write(pdcp_bus_t *bus, uint8_t input, bool for_device)
{
    const pdcp_channel_t *channel = &bus->tables.channels[input];
    const bool is_active = channel->link == PDCP_LINK_ACTIVE;
    pdcp_job_begin(bus, PDCP_TODO_WRITE, input, is_active ? channel->source.channel : (uint8_t)PDCP_NONE);
    if (for_device) {
        bus->link.job.for_device = true;
        bus->link.job.step = PDCP_STEP_READ_VID_PID;
    }
}

/* --- Outcome --- */

/* The link of an input could not be made: it is what it was before, or remembered as inactive; one that
 * worked is made anew. input: NULL if it is gone. */
static void settle_failed(pdcp_bus_t *bus, pdcp_channel_t *input)
{
    const pdcp_job_t *job = &bus->link.job;
    pdcp_bus_count(bus, PDCP_STAT_LINK_FAILED);
    if (job->output_was_on) {
        pdcp_ends_release(bus, job->output); /* whose other listeners may be gone meanwhile */
    } else {
        pdcp_ends_silence_again(bus, job->output);
    }
    if (job->old.channel != job->output) {
        pdcp_ends_release(bus, job->old.channel);
    }
    if (input == NULL) {
        return;
    }
    input->source.channel = input->link != PDCP_LINK_NONE ? pdcp_ends_source(bus, input) : PDCP_NONE;
    if (job->old_link == PDCP_LINK_ACTIVE) {
        pdcp_ends_note(bus, job->input, PDCP_TODO_CONNECT);
    } else if (input->link == PDCP_LINK_INACTIVE && job->status == PDCP_ERR_NO_ANSWER && !bus->link.planned) {
        pdcp_bus_wake(bus, PDCP_TIMER_LINK, PDCP_LINK_PAUSE_MS); /* D-BUS-26 */
    }
    pdcp_ends_silence_again(bus, job->input);
}

static void settle_made(pdcp_bus_t *bus, pdcp_channel_t *input)
{
    input->link = PDCP_LINK_ACTIVE;
    /* What was noted while it was being made. */
    pdcp_ends_drop(input, PDCP_TODO_CONNECT | PDCP_TODO_WRITE | PDCP_ENDS_SILENCES);
    pdcp_ends_release(bus, bus->link.job.old.channel); /* unless it is the same: that one is needed */
}

static void settle_silenced(pdcp_bus_t *bus, pdcp_channel_t *input)
{
    const pdcp_job_t *job = &bus->link.job;
    if (job->status == PDCP_ERR_NO_ANSWER) {
        pdcp_ends_silence_again(bus, job->input);
        pdcp_ends_silence_again(bus, job->output);
    }
    if (input != NULL && job->kind == PDCP_TODO_REMOVE) {
        input->link = PDCP_LINK_NONE;
        input->source.channel = PDCP_NONE;
        pdcp_ends_release(bus, job->old.channel);
    }
}

/* The tables and notes follow the outcome. A job that writes what the tables say changes neither. */
static void settle(pdcp_bus_t *bus, pdcp_channel_t *input)
{
    const pdcp_job_t *job = &bus->link.job;
    if (job->kind == PDCP_TODO_CONNECT || job->kind == PDCP_TODO_UPDATE) {
        if (job->status == PDCP_OK) {
            settle_made(bus, input);
        } else {
            settle_failed(bus, input);
        }
    } else if (job->kind != PDCP_TODO_WRITE) {
        settle_silenced(bus, input);
    }
}

static void tell_outcome(pdcp_bus_t *bus)
{
    const pdcp_job_t *job = &bus->link.job;
    const pdcp_status_t status = (pdcp_status_t)job->status;
    if (job->input != PDCP_NONE) {
        pdcp_bus_tell_link(bus, PDCP_EVENT_LINK, job->input, status);
    }
    if (job->for_host) {
        pdcp_bus_tell_link(bus, PDCP_EVENT_LINK_REQUEST, job->input, status);
    }
}

static void end(pdcp_bus_t *bus)
{
    pdcp_job_t *job = &bus->link.job;
    pdcp_channel_t *input = pdcp_ends_channel(bus, job->input);
    job->active = false;
    settle(bus, input);
    if (job->for_device && input != NULL && /* a device that was not read asks again */
        (job->status != PDCP_ERR_NO_ANSWER || !pdcp_step_is_reading(job->step))) {
        pdcp_ends_answer_update(bus, input->place, input->index, input->link == PDCP_LINK_ACTIVE);
    }
    if (job->kind != PDCP_TODO_WRITE) {
        tell_outcome(bus);
    }
}

/* Stops making the link and undoes it. Once the source was written, steps run backwards, the failed one
 * first: whether it was carried out nobody knows (D-BUS-21). */
static void give_up(pdcp_bus_t *bus, pdcp_status_t status)
{
    pdcp_job_t *job = &bus->link.job;
    pdcp_channel_t *input = pdcp_ends_channel(bus, job->input);
    job->status = (int8_t)status;
    if (input != NULL) {
        give_back_old(job, input);
    }
    if (job->step < PDCP_STEP_VID_PID) {
        end(bus);
        return;
    }
    job->undoing = true;
}

/* --- Steps --- */

/* Is the last step of the job done? Of an input without an active link no more is written than its source. */
static bool is_done(pdcp_bus_t *bus)
{
    const pdcp_job_t *job = &bus->link.job;
    const bool silences = job->kind == PDCP_TODO_SILENCE || job->kind == PDCP_TODO_AGAIN;
    const pdcp_channel_t *input = pdcp_ends_channel(bus, job->input);
    uint8_t last = PDCP_STEP_OUTPUT_ON;
    if (job->undoing) {
        return job->step == (silences ? PDCP_STEP_NODES : PDCP_STEP_VID_PID);
    }
    if (job->kind == PDCP_TODO_WRITE && (input == NULL || input->link != PDCP_LINK_ACTIVE)) {
        last = PDCP_STEP_TYPE;
    }
    return job->step >= last;
}

/* Goes on to the step that comes next in the job's direction; behind the last one the job is over. */
static void advance(pdcp_bus_t *bus)
{
    pdcp_job_t *job = &bus->link.job;
    if (is_done(bus)) {
        end(bus);
    } else if (job->undoing) {
        job->step--;
    } else {
        job->step++;
    }
}

void pdcp_job_run(pdcp_bus_t *bus)
{
    pdcp_job_t *job = &bus->link.job;
    while (job->active && job->at == PDCP_NONE) {
        const pdcp_step_result_t result = pdcp_step_send(bus);
        if (result == PDCP_STEP_LATER) {
            return;
        }
        if (result == PDCP_STEP_SENT) {
            job->at = pdcp_step_channel(bus)->place;
        } else if (result == PDCP_STEP_NOTHING || job->undoing || job->kind == PDCP_TODO_WRITE) {
            advance(bus);
        } else {
            give_up(bus, PDCP_ERR_NO_ANSWER);
        }
    }
}

/* --- Answers --- */

/* Update Data Channel, once 5 and 6 are read: the job goes on if the source that they name is on the bus. */
static void resolve(pdcp_bus_t *bus)
{
    pdcp_job_t *job = &bus->link.job;
    pdcp_channel_t *input = pdcp_ends_channel(bus, job->input);
    job->output = pdcp_ends_source(bus, input);
    if (input->link == PDCP_LINK_ACTIVE && job->output == input->source.channel) {
        end(bus);
        return;
    }
    input->link = pdcp_tables_is_named(input->source.index) ? PDCP_LINK_INACTIVE : PDCP_LINK_NONE;
    take_old(job, input);
    if (job->output == PDCP_NONE) {
        if (input->enabled) {
            pdcp_ends_note(bus, job->input, PDCP_TODO_SILENCE); /* it still hears the source it had */
        }
        job->status = PDCP_ERR_UNKNOWN;
        end(bus);
        return;
    }
    name_source(bus, input);
    job->step++;
}

/* Update Data Channel while a stored configuration decides: 5 and 6 are read, and written if the device names
 * something else (D-BUS-38). */
static void look_at_source(pdcp_bus_t *bus)
{
    pdcp_job_t *job = &bus->link.job;
    if (job->step == PDCP_STEP_READ_VID_PID) {
        job->step++;
    } else if (job->differs) {
        job->step = PDCP_STEP_VID_PID;
    } else {
        end(bus);
    }
}

/* What a device refuses is left out, and so is all else that is for a silent one: an audit finds what is
 * still wrong (D-BUS-40). A device that cannot be read asks again. */
static void leave_out(pdcp_bus_t *bus, pdcp_status_t status)
{
    pdcp_job_t *job = &bus->link.job;
    const bool silent = status == PDCP_ERR_NO_ANSWER;
    if (pdcp_step_is_reading(job->step)) {
        if (silent) {
            job->status = (int8_t)status;
            end(bus);
        } else {
            look_at_source(bus);
        }
        return;
    }
    if (silent) {
        job->step = job->step < PDCP_STEP_OUTPUT_ID_AGAIN ? PDCP_STEP_INPUT_ON : PDCP_STEP_OUTPUT_ON;
    }
    advance(bus);
}

/* A step backwards was refused or not answered: what follows is for the same silent device, but for the
 * first one, which is for the output. */
static void go_on_undoing(pdcp_bus_t *bus, pdcp_status_t status)
{
    pdcp_job_t *job = &bus->link.job;
    const bool silent = status == PDCP_ERR_NO_ANSWER;
    if (silent) {
        job->status = (int8_t)status;
    }
    if (silent && job->step != PDCP_STEP_OUTPUT_ON) {
        end(bus);
    } else {
        advance(bus);
    }
}

/* A step was refused or not answered. */
static void on_failure(pdcp_bus_t *bus, pdcp_status_t status)
{
    pdcp_job_t *job = &bus->link.job;
    if (job->kind == PDCP_TODO_WRITE) {
        leave_out(bus, status);
        return;
    }
    if (job->step == PDCP_STEP_OUTPUT_ID) {
        pdcp_channel_t *output = pdcp_step_channel(bus);
        if (output != NULL && output->node_id != 0) {
            pdcp_bind_take_output_id(bus, output); /* it may have it, and gets another one */
        }
    }
    if (job->undoing) {
        go_on_undoing(bus, status);
    } else if (job->step == PDCP_STEP_TYPE && status == PDCP_ERR_REFUSED) {
        advance(bus); /* a device without the profile layer (D-BUS-20) */
    } else {
        job->once = status == PDCP_ERR_NO_ANSWER;
        give_up(bus, status);
    }
}

static void on_success(pdcp_bus_t *bus, const pdcp_reply_t *reply)
{
    pdcp_job_t *job = &bus->link.job;
    job->differs = !pdcp_step_take(bus, reply) || job->differs;
    job->once = false;
    if (job->kind == PDCP_TODO_WRITE && pdcp_step_is_reading(job->step)) {
        look_at_source(bus);
    } else if (job->step == PDCP_STEP_READ_SERIAL) {
        resolve(bus);
    } else if (job->undoing || job->input != PDCP_NONE) { /* else pdcp_job_run finds out, and gives up */
        advance(bus);
    }
}

void pdcp_job_on_reply(pdcp_bus_t *bus, const pdcp_reply_t *reply)
{
    bus->link.job.at = PDCP_NONE;
    if (reply->status == PDCP_OK) {
        on_success(bus, reply);
    } else {
        on_failure(bus, (pdcp_status_t)reply->status);
    }
    pdcp_job_run(bus);
}

/* --- Interruptions --- */

void pdcp_job_on_lost(pdcp_bus_t *bus, uint8_t place)
{
    pdcp_assert(pdcp_request_is_idle(bus, place), "pdcp_job.h: the request is cancelled");
    pdcp_job_t *job = &bus->link.job;
    if (!job->active) {
        return;
    }
    if (pdcp_ends_place(bus, job->input) == place) {
        if (!job->undoing && job->kind != PDCP_TODO_WRITE) {
            give_back_old(job, &bus->tables.channels[job->input]);
        }
        job->input = PDCP_NONE;
    }
    if (pdcp_ends_place(bus, job->output) == place) {
        job->output = PDCP_NONE;
    }
    if (job->at == place) {
        job->at = PDCP_NONE;
    }
}

/* The host waits no longer: its link is undone if it is half made (D-API-16). */
uint8_t pdcp_job_give_up_request(pdcp_bus_t *bus)
{
    pdcp_job_t *job = &bus->link.job;
    const uint8_t at = job->at;
    if (!job->active || !job->for_host) {
        return PDCP_NONE;
    }
    job->for_host = false;
    pdcp_bus_tell_link(bus, PDCP_EVENT_LINK_REQUEST, job->input, PDCP_ERR_NO_ANSWER);
    if (job->undoing) {
        return PDCP_NONE;
    }
    if (at != PDCP_NONE) {
        pdcp_request_cancel(bus, at);
        job->at = PDCP_NONE;
    }
    on_failure(bus, PDCP_ERR_NO_ANSWER);
    pdcp_job_run(bus);
    return at;
}

void pdcp_job_break_off(pdcp_bus_t *bus)
{
    pdcp_job_t *job = &bus->link.job;
    if (job->at != PDCP_NONE) {
        const pdcp_device_entry_t *device = pdcp_bus_device(bus, job->at);
        if (device->asked_again || device->reset_asked) {
            return;
        }
        pdcp_request_cancel(bus, job->at);
        job->at = PDCP_NONE;
    }
    job->active = false;
    pdcp_ends_silence_again(bus, job->input);
    pdcp_ends_silence_again(bus, job->output);
}
