#include "pdcp_identity.h"

bool pdcp_identity_equal(const pdcp_identity_t *a, const pdcp_identity_t *b)
{
    return a->vid == b->vid && a->pid == b->pid && a->sn == b->sn;
}
