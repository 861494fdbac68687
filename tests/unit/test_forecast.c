/* Claims about the law by which a trial is continued. */
#include "app/forecast.h"
#include "unit.h"

enum { BALLS = 1000 };
static struct mill_ball ball[BALLS];
static struct mill_species steel = {.radius = 0.0025, .mass = 5e-4};

/* 3 % of the drum, at rest, 100 rad/s */
static struct mill_world world_of(void)
{
    return (struct mill_world){.g = {0, 0, -9.81},
                               .balls = BALLS,
                               .ball = ball,
                               .species = &steel,
                               .drum_radius = 0.075,
                               .drum_length = 0.12,
                               .rotor_speed = 100,
                               .container = {.still = true},
                               .law = {{.restitution = 0.8}}};
}

/* Contacts per second at a time, over those of the steady mill */
static double rate_at(const struct mill_world *world, double time)
{
    const struct mill_forecast_growth growth = mill_forecast_growth(world);
    const double more = mill_forecast_work(&growth, time + 1e-6);
    return (more - mill_forecast_work(&growth, time)) / 1e-6;
}

TEST(the_rate_grows_until_the_charge_is_swept_up_and_is_steady_then)
{
    const struct mill_world world = world_of();
    const struct mill_forecast_growth growth = mill_forecast_growth(&world);
    ck_assert(growth.swept > 0 && growth.power > 1);
    ck_assert(fabs(rate_at(&world, 0) / exp(-growth.power) - 1) < 1e-3);
    ck_assert(fabs(rate_at(&world, growth.swept / 2) / exp(-growth.power / 2) - 1) < 1e-3);
    ck_assert(fabs(rate_at(&world, growth.swept) - 1) < 1e-6);
    ck_assert(fabs(rate_at(&world, 10 * growth.swept) - 1) < 1e-6);
}

TEST(a_fuller_drum_is_swept_up_sooner)
{
    struct mill_world world = world_of();
    const double sparse = mill_forecast_growth(&world).swept;
    steel.radius *= 2.2;
    ck_assert(mill_forecast_growth(&world).swept < sparse);
}

TEST(inelastic_balls_have_more_to_grow)
{
    struct mill_world world = world_of();
    const double elastic = mill_forecast_growth(&world).power;
    world.law[MILL_BALL_BALL].restitution = 0.6;
    ck_assert(mill_forecast_growth(&world).power > elastic);
}

TEST(nothing_grows_without_a_rapid_rotor_in_a_still_drum_or_where_the_charge_moves)
{
    struct mill_world slow = world_of(), still = world_of(), moving = world_of();
    slow.rotor_speed = -5;
    still.rotor_speed = 0;
    moving.start.kinetic = 0.5 * BALLS * steel.mass; /* 1 m/s each; the rotor's ends: 7.5 */
    ck_assert(fabs(rate_at(&slow, 0) - 1) < 1e-6);
    ck_assert(fabs(rate_at(&still, 0) - 1) < 1e-6);
    ck_assert(fabs(rate_at(&moving, 0) - 1) < 1e-6);
    struct mill_world tumbling = world_of();
    tumbling.container.still = false;
    ck_assert(fabs(rate_at(&tumbling, 0) - 1) < 1e-6);
}

int main(void)
{
    return unit_run("forecast");
}
