/* Libraries that end the program. */
#ifndef NB_TOOLS_ABORT_GUARD_H
#define NB_TOOLS_ABORT_GUARD_H

/* Embree and what it uses throw where nobody catches when memory is out at the wrong moment. From now on that ends the
 * program with a message and the status of failed work, like every other lack of memory. An abort for another reason
 * ends it as ever. */
void nb_abort_explain(void);

#endif
