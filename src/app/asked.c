#include "app/asked.h"

#include "base/profile.h"
#include "geometry/shapes.h"

struct mill_profile mill_asked_profile(const struct mill_deck *deck, const struct mill_world *world)
{
    const struct mill_setup_drum drum = mill_deck_drum(deck);
    return drum.radius > 0 ? mill_shapes_chamber(&drum).drum
                           : mill_profile_make(2, world->drum_radius, 0, 0);
}

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
        .drum = mill_asked_profile(deck, world),
    };
    for (int kind = 0; kind < world->kinds.count; kind++)
        asked.wear[kind] = (struct mill_wear_law){
            deck->wear[kind].archard, deck->wear[kind].hardness, deck->wear[kind].erosion};
    return asked;
}
