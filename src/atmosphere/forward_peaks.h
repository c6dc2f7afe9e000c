/* Light that forward peaks of phase functions turn: it goes nearly straight on, and smooth air (nb_air_components_smooth) lets it pass. */
#ifndef NB_ATMOSPHERE_FORWARD_PEAKS_H
#define NB_ATMOSPHERE_FORWARD_PEAKS_H

#include "in_scattering.h"

/* The share of scattered light that peaks turn n times, n - 1 of them on the way to or from a node, is t^(n - 1) / n! of the sunlight
 * that comes straight, if they turn it t times in the mean; n is at most NB_PEAK_POWERS, and once more for the rest. */
enum { NB_PEAK_POWERS = 8 };

/* Sums over nodes of a ray, for phase functions of 1. */
typedef struct nb_peak_sums {
    double often[3], missing[3];           /* as of nb_node_light */
    double ahead[NEBEL_MAX_COMPONENTS][3]; /* scattering times sunlight ahead */
    /* Scattering times straight sunlight times powers of t, from 0 on, and behind them the rest of the series. */
    double powers[NEBEL_MAX_COMPONENTS][3][NB_PEAK_POWERS + 1];
} nb_peak_sums;

/* What phase functions give towards a ray, of sunlight. */
typedef struct nb_peaks {
    int air_count;
    nb_strays strays;                  /* as of the job */
    double peak[NEBEL_MAX_COMPONENTS]; /* the part of what is scattered that the peak turns; 0: there is none */
    double smooth[NEBEL_MAX_COMPONENTS];
    /* Per power; the first is not used: light scattered once has its own phase function. */
    double turned[NEBEL_MAX_COMPONENTS][NB_PEAK_POWERS + 1];
} nb_peaks;

/* Orders of moments behind those that are kept of a function of Henyey and Greenstein, in units of the first of them. */
double nb_peak_rest(double g, int orders, double cosine);

/* The ratio of the first moment that is not kept to the last one that is; 0 unless it is smaller. */
double nb_peak_ratio(const nb_air_component *air, int orders);

/* All 0 where there is no smooth air. */
nb_peaks nb_peaks_aim(const nb_gather_job *job);

/* Adds nodes `from` to `to` - 1, of which the light is at hand. */
void nb_peaks_add(const nb_peaks *peaks, const nb_gather_job *job, const nb_node_light *light, int from, int to,
                  nb_peak_sums *sums);

/* Light and what may be wrong of it. */
typedef struct nb_peak_light {
    double light[3], missing[3];
} nb_peak_light;

/* What is scattered often, of the nodes before an end: light of smooth air, and sunlight that peaks turn. */
nb_peak_light nb_peaks_before(const nb_peaks *peaks, const nb_peak_sums *before);

/* Light that comes from behind an end, as it comes to the ray's start through smooth air: of the nodes there, turned once more, and of the
 * ground. */
void nb_peaks_behind(const nb_peaks *peaks, const nb_peak_sums *behind, const double ground[3], double light[3]);

#endif
