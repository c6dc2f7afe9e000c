/* The files of tests/truth: a scene, rays, and what brute force in Python says of them. */
#ifndef TRUTH_FILE_H
#define TRUTH_FILE_H

#include <nebel/nebel.h>

typedef struct truth_ray {
    nebel_ray ray;
    double T[3], S[3];
    double uncertainty; /* of those, as far as the file knows */
} truth_ray;

typedef struct truth_file {
    size_t volume_count, ray_count;
    nebel_volume_desc *volumes;
    double ambient[3];
    truth_ray *rays;
} truth_file;

/* Reads tests/truth/<name>. Ends the program when the file is missing or not as expected. */
truth_file truth_read(const char *folder, const char *name);
void truth_free(truth_file *file);

#endif
