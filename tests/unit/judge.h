/* A naive judge of plans for random limbs (random_limb.h). It shares nothing with the planner but the tables,
 * and fails with the limb's seed. */
#ifndef JUDGE_H
#define JUDGE_H

#include "random_limb.h"

/* Of the plan under judgement. */
extern uint8_t judge_before[PDCP_CHANNELS_MAX]; /* the links that worked */
extern uint8_t judge_inputs[RANDOM_POOL + 1];   /* channels that are there, ended by PDCP_NONE */
extern uint8_t judge_outputs[RANDOM_POOL + 1];

/* Before the plan: notes how things are. */
void judge_look_back(void);

/* Behind the plan: what is linked may be; new links have a reason; what stands in does so for something; what
 * worked stays; nothing that was asked for is left out. */
void judge_links(void);
void judge_reasons(void);
void judge_stand_ins(void);
void judge_kept(void);
void judge_complete(uint8_t what);

/* Of a channel: what it is, whether it is there, whether it wants an output for itself. */
const systems_channel_t *judge_spec(uint8_t channel);
bool judge_is_there(uint8_t channel, uint8_t transfer);
bool judge_is_sole(uint8_t input);
bool judge_are_alike(uint8_t a, uint8_t b);

/* Another sole-access input that hears this output. */
uint8_t judge_rival(const uint8_t *links, uint8_t output, uint8_t input);

/* Takes away what lacks something, until nothing changes, but for what the host has made. */
void judge_take_lacking(uint8_t *links);

#endif
