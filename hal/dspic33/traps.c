/* The traps, and every interrupt without a handler: written down, then the program starts again. No
 * application code can go on after one of them. */
#include "handlers.h"
#include "sys.h"

void PART_HANDLER _OscillatorFail(void)
{
    sys_fail(SYS_FAULT_OSCILLATOR);
}

void PART_HANDLER _AddressError(void)
{
    sys_fail(SYS_FAULT_ADDRESS);
}

void PART_HANDLER _StackError(void)
{
    sys_fail(SYS_FAULT_STACK);
}

void PART_HANDLER _MathError(void)
{
    sys_fail(SYS_FAULT_MATH);
}

void PART_HANDLER _DMACError(void)
{
    sys_fail(SYS_FAULT_DMA);
}

void PART_HANDLER _DefaultInterrupt(void)
{
    sys_fail(SYS_FAULT_HANDLER);
}

#if PART_GENERIC_TRAPS

void PART_HANDLER _HardTrapError(void)
{
    sys_fail(SYS_FAULT_OTHER);
}

void PART_HANDLER _SoftTrapError(void)
{
    sys_fail(SYS_FAULT_OTHER);
}

#endif
