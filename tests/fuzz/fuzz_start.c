/* The start file from any bytes, for a mill with shaft and blade and balls of two sizes: refused
 * with one line, or every ball stands where its row says, nothing overlaps, and the mill runs. */
#include "mill.h"

#include "deck/deck.h"

static const char text[] = "[run]\ntime = 1 s\n[drum]\nradius = 75 mm\nlength = 120 mm\n"
                           "[contact]\nrestitution = 0.8\nfriction = 0.3\n"
                           "[rotor]\nspeed = 1000 rpm\nshaft_radius = 15 mm\n"
                           "[blade.a]\nposition = 0 mm\nangle = 0 deg\ntip_radius = 50 mm\n"
                           "width = 20 mm\nthickness = 8 mm\n"
                           "[balls.large]\ncount = 2\ndiameter = 10 mm\ndensity = 7800 kg/m^3\n"
                           "[balls.small]\ncount = 1\ndiameter = 6 mm\ndensity = 7800 kg/m^3\n";

static struct fuzz_file start_file;

static struct mill_deck *read_deck(void)
{
    static struct fuzz_file deck_file;
    char all[1024];
    struct mill_error error = {""};
    struct mill_deck *deck = NULL;
    fuzz_file_write(&start_file, "", 0);
    snprintf(all, sizeof all, "%s[balls]\nstart = %s\n", text, start_file.path);
    const char *path = fuzz_file_write(&deck_file, all, strlen(all));
    const enum mill_status status = mill_deck_read(path, 0, NULL, NULL, NULL, NULL, &deck, &error);
    fuzz_require(status == MILL_OK, "%s", error.text);
    return deck;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct mill_deck *deck;
    struct mill_world *world = NULL;
    struct mill_sim *sim = NULL;
    struct mill_error error = {""};
    if (!deck)
        deck = read_deck();
    fuzz_file_write(&start_file, data, size);
    const enum mill_status status = mill_deck_setup_world(deck, NULL, &world, &error);
    if (status != MILL_OK) {
        fuzz_require(status == MILL_BAD_DECK && !world, "status %d: %s", (int)status, error.text);
        fuzz_require_message(error.text);
        if (fuzz_shown())
            fprintf(stderr, "%s\n", error.text);
        return 0;
    }
    mill_check_overlaps(world, NULL);
    fuzz_require(mill_sim_create(world, &sim, &error) == MILL_OK, "%s", error.text);
    mill_run_checked(sim, 1.0, 300, 100);
    mill_sim_free(sim);
    mill_world_free(world);
    return 0;
}
