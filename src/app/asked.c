#include "app/asked.h"

struct mill_observe mill_asked_observe(const struct mill_deck *deck, const struct mill_world *world)
{
    struct mill_observe asked = {
        .end = deck->time,
        .sample_from = deck->sample_from,
        .sample_found = deck->sample_found,
        .precision = deck->precision,
        .max_collisions = deck->max_collisions,
        .strike_window = deck->strike_window,
        .frames = deck->frames,
        .series = deck->series,
        .log_impacts = deck->log_impacts,
        .rotor_angle = deck->rotor_angle,
    };
    for (int kind = 0; kind < world->kinds.count; kind++)
        asked.wear[kind] = (struct mill_wear_law){
            deck->wear[kind].archard, deck->wear[kind].hardness, deck->wear[kind].erosion};
    return asked;
}
