/* The contract of hal_nvm.h as tests, the same for every target's memory. */
#ifndef NVM_CONTRACT_H
#define NVM_CONTRACT_H

#include "hal_nvm.h"

/* Given by the test program: a new, empty memory, and the same one after the program was restarted. */
hal_nvm_t *nvm_contract_open(void);
hal_nvm_t *nvm_contract_reopen(hal_nvm_t *nvm);

/* Given too: lets time pass while a write is under way. */
void nvm_contract_wait(void);

/* Runs them all. */
void nvm_contract_run(void);

#endif
