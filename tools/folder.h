/* Folders for what is written. */
#ifndef NB_FOLDER_H
#define NB_FOLDER_H

/* Makes a folder and those above it, where they are missing. NB_DONE, or NB_FAILED after a message. */
int nb_folder_make(const char *folder);

/* The same of the folder that a file is in. */
int nb_folder_make_for(const char *file);

#endif
