#include "precision.h"

#include <float.h>

#if (defined(__x86_64__) || defined(__i386__)) && LDBL_MANT_DIG == 64

/* Bits 8 and 9 of the x87 control word; both set: 64 bits of significand (Intel 64 manual, volume 1, 8.1.5). The other
 * fields, exceptions among them, stay the thread's. */
#define PRECISION_BITS 0x300u

static void load_control_word(unsigned setting)
{
    const unsigned short word = (unsigned short)setting;
    __asm__ volatile("fldcw %0" : : "m"(word) : "memory");
}

unsigned nb_full_precision(void)
{
    unsigned short word;
    __asm__ volatile("fnstcw %0" : "=m"(word) : : "memory");
    if ((word & PRECISION_BITS) != PRECISION_BITS) load_control_word(word | PRECISION_BITS);
    return word;
}

void nb_restore_precision(unsigned setting)
{
    if ((setting & PRECISION_BITS) != PRECISION_BITS) load_control_word(setting);
}

#else

unsigned nb_full_precision(void)
{
    return 0;
}

void nb_restore_precision(unsigned setting)
{
    (void)setting;
}

#endif
