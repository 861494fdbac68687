/* The summary for programs: one JSON object in SI units, with every number to full precision, and
 * null for NaN and infinity. docs/file-format.md explains the keys. */
#include "app/summary.h"

#include "observe/sink_json.h"

#include <string.h>

enum mill_status mill_summary_json(const struct mill_summary *s, struct mill_error *error)
{
    struct mill_sink_json json;
    struct mill_sink *sink = &json.sink;
    const struct mill_facts *facts = s->facts;
    mill_sink_json_begin(&json, s->out);
    sink->text(sink, "version", facts->version, "");
    sink->text(sink, "deck", facts->deck, "");
    sink->text(sink, "output", facts->output, "");
    mill_sink_json_next(&json, "stopped");
    fputs(strcmp(facts->status, "stopped") == 0 ? "true" : "false", s->out);
    mill_tell_number(sink, "time", facts->time, "s", "");
    mill_tell_number(sink, "sample_from", s->results->begin, "s", "");
    sink->open(sink, "run");
    mill_record_tell(s->world, facts, sink);
    mill_notes_tell(&s->notes, NULL, sink);
    sink->close(sink);
    sink->open(sink, "assumed");
    for (int kind = 0; s->deck && kind < s->deck->contacts.count; kind++)
        if (s->deck->assumed[kind][0])
            sink->text(sink, s->deck->contacts.name[kind], s->deck->assumed[kind], "");
    sink->close(sink);
    const enum mill_status status =
        mill_observers_results(s->observers, s->world, facts->local, sink, error);
    mill_notes_write(&s->notes, &json);
    mill_sink_json_end(&json);
    return status;
}
