#include "app/asked.h"

struct mill_observe mill_asked_observe(const struct mill_deck *deck, const struct mill_world *world)
{
    struct mill_observe asked = {
        .end = deck->given.time,
        .sample_from = deck->given.sample_from,
        .sample_found = deck->mill.sample_found,
        .precision = deck->given.precision,
        .max_collisions = deck->given.max_collisions,
        .strike_window = deck->given.strike_window,
        .frames = deck->given.frames,
        .series = deck->given.series,
        .log_impacts = deck->given.log_impacts,
        .rotor_angle = deck->given.rotor.angle,
    };
    for (int kind = 0; kind < world->kinds.count; kind++)
        asked.wear[kind] = (struct mill_wear_law){deck->mill.contact[kind].wear.archard,
                                                  deck->mill.contact[kind].wear.hardness,
                                                  deck->mill.contact[kind].wear.erosion};
    return asked;
}
