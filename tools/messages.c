#define _POSIX_C_SOURCE 200809L

#include "messages.h"

#include "fd_output.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { MESSAGE_SIZE = 8192 };

static size_t status_length;

static void put(const char *text, size_t size)
{
    (void)nb_output_write(STDERR_FILENO, text, size);
}

/* Bytes of the character of UTF-8 at the start of a text that ends with a 0; 0 where there is none, or a control character. */
static size_t printable_size(const char *text)
{
    const unsigned char *const byte = (const unsigned char *)text;
    if (byte[0] < 0x80) return byte[0] >= 0x20 && byte[0] != 0x7f;
    const size_t size = byte[0] >= 0xf0 ? 4 : byte[0] >= 0xe0 ? 3 : 2;
    uint32_t code = byte[0] & (0x7fu >> size);
    for (size_t i = 1; i < size; i++) {
        if ((byte[i] & 0xc0) != 0x80) return 0;
        code = code << 6 | (byte[i] & 0x3fu);
    }
    static const uint32_t least[] = {[2] = 0xa0, [3] = 0x800, [4] = 0x10000};
    return byte[0] < 0xf8 && code >= least[size] && code <= 0x10ffff && (code < 0xd800 || code > 0xdfff) ? size : 0;
}

void nb_report_mask(char *text)
{
    while (*text != '\0') {
        const size_t size = printable_size(text);
        if (size == 0) *text = '?';
        text += size > 0 ? size : 1;
    }
}

/* One write for the whole line: messages of several programs in a pipeline do not mix. */
static void write_line(const char *format, va_list arguments)
{
    static const char prefix[] = "nebel: ", cut[] = " ...";
    char line[sizeof prefix - 1 + MESSAGE_SIZE + sizeof cut];
    memcpy(line, prefix, sizeof prefix - 1);
    char *const text = line + sizeof prefix - 1;
    const int wanted = vsnprintf(text, MESSAGE_SIZE, format, arguments);
    size_t size = wanted < 0 ? 0 : (size_t)wanted;
    if (size >= MESSAGE_SIZE) {
        memcpy(text + MESSAGE_SIZE - 1, cut, sizeof cut - 1);
        size = MESSAGE_SIZE - 1 + sizeof cut - 1;
    }
    text[size] = '\0';
    nb_report_mask(text);
    text[size] = '\n';
    nb_report_status("");
    put(line, sizeof prefix - 1 + size + 1);
}

void nb_report_message(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    write_line(format, arguments);
    va_end(arguments);
}

int nb_report_failure(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    write_line(format, arguments);
    va_end(arguments);
    return NB_FAILED;
}

int nb_report_misuse(const char *command, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    write_line(format, arguments);
    va_end(arguments);
    if (command != NULL) {
        nb_report_message("'nebel %s --help' explains the options", command);
    } else {
        nb_report_message("'nebel --help' lists the commands");
    }
    return NB_MISUSED;
}

/* What "ray 7: ..." goes on with. The numbers count rays of a single query, which nobody knows who reads the message.
 */
static const char *skip_ray(const char *message)
{
    static const char subject[] = "ray ";
    const size_t size = sizeof subject - 1;
    if (strncmp(message, subject, size) != 0) return message;
    const size_t digits = strspn(message + size, "0123456789");
    const char *const rest = message + size + digits;
    return digits > 0 && strncmp(rest, ": ", 2) == 0 ? rest + 2 : message;
}

static void hand_on(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    nb_report_listener *const listener = user;
    (void)result;
    if (level == NEBEL_LOG_WARNING) { /* which no quiet hides */
        if (listener->mode != NB_REPORT_DROP) nb_report_message("warning: %s", message);
        return;
    }
    if (level == NEBEL_LOG_INFO) {
        if (!listener->quiet && listener->mode != NB_REPORT_DROP) nb_report_message("note: %s", message);
        return;
    }
    if (listener->mode == NB_REPORT_KEEP && atomic_fetch_add(&listener->kept_count, 1) == 0) {
        (void)snprintf(listener->kept, sizeof listener->kept, "%s", skip_ray(message));
    }
    if (listener->mode != NB_REPORT_PRINT) return;
    listener->printed++;
    nb_report_message("%s", message);
}

nebel_log nb_report_log(nb_report_listener *listener)
{
    return (nebel_log){.write = hand_on, .user = listener};
}

int nb_report_result(const nb_report_listener *listener, const char *what, nebel_result result)
{
    if (listener->printed == 0) nb_report_message("%s: %s", what, nebel_result_text(result));
    return NB_FAILED;
}

void nb_report_status(const char *text)
{
    if (text[0] == '\0' && status_length == 0) return;
    char line[1024];
    const size_t size = strlen(text) < sizeof line / 2 ? strlen(text) : sizeof line / 2;
    const size_t blanks = status_length > size ? status_length - size : 0;
    line[0] = '\r';
    memcpy(line + 1, text, size);
    memset(line + 1 + size, ' ', blanks);
    size_t used = 1 + size + blanks;
    if (size == 0) line[used++] = '\r';
    put(line, used);
    status_length = size;
}
