/* The answer of nebel-read-model: taken from a pipe, and believed in nothing. */
#ifndef NB_MODEL_MODEL_RECEIVE_H
#define NB_MODEL_MODEL_RECEIVE_H

#include "model.h"
#include "model_budget.h"
#include "model_wire.h"

typedef enum nb_receipt {
    NB_RECEIPT_WHOLE,   /* the result is in the receiver */
    NB_RECEIPT_CUT,     /* it ended too early */
    NB_RECEIPT_LATE,    /* it took too long */
    NB_RECEIPT_TOO_BIG, /* more than the budget allows */
    NB_RECEIPT_BAD,     /* it is not what the two agreed on */
    NB_RECEIPT_VERSION, /* it comes from another version */
    NB_RECEIPT_REFUSED, /* more than is left to the scene, which has been said: the result */
    NB_RECEIPT_MEMORY   /* out of memory here */
} nb_receipt;

typedef struct nb_receiver {
    const nb_model_load *load;
    int file;            /* to read from */
    nb_budget *budget;   /* has the model's own file */
    double start;        /* s, of the monotonic clock */
    nebel_result result; /* of the reading, once it is whole */
    uint64_t taken;      /* bytes that are kept */
    unsigned messages;
    nb_wire_end counts;
} nb_receiver;

/* Takes the answer; meshes, textures and points go where the load says. What came before an error stays there. */
nb_receipt nb_model_receive(nb_receiver *in);

#endif
