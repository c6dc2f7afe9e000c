#include <nebel/nebel.h>

#include <math.h>

double nebel_extinction_from_visibility(double visibility, double contrast)
{
    const double seen = contrast == 0 ? 0.05 : contrast;
    if (!(visibility > 0 && seen > 0 && seen < 1)) return (double)NAN;
    return -log(seen) / visibility;
}
