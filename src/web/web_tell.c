#include "web/web.h"

#include "deck/deck.h"
#include "observe/energies.h"
#include "observe/sink_json.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const key_type[] = {"number", "vector", "whole", "choice", "file", "name"};

static void tell_text(struct mill_sink_json *json, const char *name, const char *value)
{
    mill_tell_text(&json->sink, name, value ? value : "", "");
}

static void tell_key(void *self, const char *section, const struct mill_key *key, const char *value)
{
    struct mill_sink_json *json = self;
    struct mill_sink *sink = &json->sink;
    const bool counts = key->type <= MILL_KEY_WHOLE;
    sink->open(sink, NULL);
    tell_text(json, "section", section);
    tell_text(json, "key", key->name);
    tell_text(json, "value", value);
    tell_text(json, "type", key_type[key->type]);
    tell_text(json, "unit", key->unit);
    mill_tell_number(sink, "lo", counts ? key->lo : (double)NAN, "", "");
    mill_tell_number(sink, "hi", counts ? key->hi : (double)NAN, "", "");
    mill_tell_count(sink, "above", key->above, "");
    tell_text(json, "words", key->words);
    tell_text(json, "meaning", key->meaning);
    tell_text(json, "instead", key->instead);
    sink->close(sink);
}

/* The keys of the deck, and those that can give the number of balls instead */
static void tell_keys(struct mill_sink_json *json, const struct mill_deck *deck)
{
    static const char *const amount[] = {"fill", "bulk_fill", "mass"};
    mill_sink_json_open_array(json, "keys");
    mill_deck_each(deck, tell_key, json);
    for (int k = 0; k < deck->setup.species; k++)
        for (size_t i = 0; i < sizeof amount / sizeof *amount; i++) {
            const char *section = deck->mill.balls[k].section;
            const struct mill_key *key = mill_deck_table_key(section, amount[i], 0);
            if (key)
                tell_key(json, section, key, "");
        }
    mill_sink_json_close_array(json);
}

static void tell_names(struct mill_sink_json *json, const char *name, int n, const char *const *of)
{
    const size_t names = (size_t)n;
    json->sink.values(&json->sink, name, MILL_H5_TEXT, 1, &names, of, "", "");
}

static void tell_warnings(struct mill_sink_json *json, const char *warnings)
{
    mill_sink_json_open_array(json, "warnings");
    while (*warnings) {
        char line[1024];
        const size_t length = strcspn(warnings, "\n");
        snprintf(line, sizeof line, "%.*s", (int)length, warnings);
        warnings += length + (warnings[length] == '\n');
        mill_sink_json_next(json, NULL);
        mill_sink_json_string(json, line);
    }
    mill_sink_json_close_array(json);
}

static void tell_species(struct mill_sink_json *json, const struct mill_world *world)
{
    struct mill_sink *sink = &json->sink;
    mill_sink_json_open_array(json, "species");
    for (int k = 0; k < world->species_count; k++) {
        sink->open(sink, NULL);
        tell_text(json, "name", world->species[k].name);
        mill_tell_number(sink, "diameter", 2 * world->species[k].radius, "m", "");
        mill_tell_number(sink, "mass", world->species[k].mass, "kg", "");
        sink->close(sink);
    }
    mill_sink_json_close_array(json);
    mill_sink_json_open_array(json, "species_of");
    for (int32_t i = 0; i < world->balls; i++) {
        mill_sink_json_next(json, NULL);
        fprintf(json->out, "%d", world->ball[i].species);
    }
    mill_sink_json_close_array(json);
}

/* Which kinds of contact are those of the container? */
static void tell_container(struct mill_sink_json *json, const struct mill_deck *deck,
                           const struct mill_world *world)
{
    const struct mill_container *c = &world->container;
    struct mill_sink *sink = &json->sink;
    const struct mill_reach *places = &c->places;
    const double box[6] = {places->lo.x, places->lo.y, places->lo.z,
                           places->hi.x, places->hi.y, places->hi.z};
    const struct mill_listed listed = mill_kinds_listed(world);
    const struct mill_setup_surface *body = deck->mill.container;
    const double kinds[2] = {listed.number[body ? body->kind : MILL_BALL_DRUM],
                             listed.number[body ? body->kind : MILL_BALL_WALL]};
    const vec3 axis = mill_world_frame(world, 0).x;
    mill_tell_array(sink, "axis", 3, &axis.x, "1", "");
    mill_tell_number(sink, "carrier", c->motion ? c->motion->number : -1, "", "");
    mill_tell_array(sink, "box", 6, box, "m", "");
    mill_tell_array(sink, "container", 2, kinds, "", "");
    mill_tell_number(sink, "volume", c->volume, "m3", "");
    mill_tell_number(sink, "slice", c->period, "m", "");
    mill_tell_array(sink, "gravity", 3, &world->g.x, "", "");
    mill_tell_number(sink, "period", world->period, "s", "");
    mill_tell_number(sink, "end", deck->observe.end, "s", "");
}

void mill_web_tell(FILE *out, const struct mill_deck *deck, const struct mill_world *world,
                   const char *warnings)
{
    const struct mill_listed kinds = mill_kinds_listed(world);
    const char *motion[MILL_MOTIONS_MOST];
    char *text = mill_deck_printed(deck, mill_deck_print);
    struct mill_sink_json json;
    for (int k = 0; k < world->motions; k++)
        motion[k] = world->motion_name[k];
    mill_sink_json_begin(&json, out);
    tell_text(&json, "deck", text);
    free(text);
    mill_tell_count(&json.sink, "balls", (uint64_t)world->balls, "");
    mill_tell_count(&json.sink, "bins", MILL_ENERGIES_BINS, "");
    tell_keys(&json, deck);
    tell_warnings(&json, warnings);
    tell_names(&json, "kinds", kinds.count, kinds.name);
    tell_names(&json, "motions", world->motions, motion);
    tell_species(&json, world);
    tell_container(&json, deck, world);
    mill_sink_json_end(&json);
}
