#include "noise_estimate.h"

#include "messages.h"

#include <math.h>

void nb_spread_report(const float *errors, size_t count, uint32_t samples)
{
    double squares = 0;
    for (size_t i = 0; i < count; i++) squares += (double)errors[i] * (double)errors[i];
    if (samples < 2)
        nb_report_message("note: one sample knows no standard error; ask for more --samples");
    else
        nb_report_message("note: standard error %.2g of a pixel, %.2g of the mean of all",
                          sqrt(squares / (double)count), sqrt(squares) / (double)count);
}
