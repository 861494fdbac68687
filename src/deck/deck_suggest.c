/* For a wrong name (of a section, of a key, or of anything else that a deck names), finds the most
 * similar right one. */
#include "deck/deck_private.h"

#include <stdio.h>
#include <string.h>

static char lower(char c)
{
    return c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c;
}

/* Do at most `edits` edits turn a into b? An edit adds, removes or changes a letter, or swaps two.
 * Upper and lower case are equal. */
static bool is_near(const char *a, const char *b, int edits)
{
    for (; *a && lower(*a) == lower(*b); a++)
        b++;
    if (!*a && !*b)
        return true;
    const bool both = *a && *b;
    const bool swapped = both && lower(a[0]) == lower(b[1]) && lower(a[1]) == lower(b[0]);
    return edits > 0 &&
           ((both && is_near(a + 1, b + 1, edits - 1)) || (*a && is_near(a + 1, b, edits - 1)) ||
            (*b && is_near(a, b + 1, edits - 1)) || (swapped && is_near(a + 2, b + 2, edits - 1)));
}

int mill_deck_suggest_edits(const char *word, const char *text)
{
    const int third = (int)strlen(word) / 3, most = third > 1 ? third : 1;
    for (int n = 0; n <= most && n < MILL_DECK_MOST_EDITS; n++)
        if (is_near(text, word, n))
            return n;
    return MILL_DECK_MOST_EDITS;
}

/* "run", "balls.NAME" */
static void name_block(const struct mill_deck_block *block, const char *name, char out[40])
{
    snprintf(out, 40, "%s%s%s", block->title, block->named ? "." : "", block->named ? name : "");
}

void mill_deck_suggest_key(const char *title, const char *name, char *hint, size_t size)
{
    const int stem_length = (int)strcspn(title, ".") + 1;
    char stem[40], word[40];
    struct mill_deck_block block;
    int edits, best = MILL_DECK_MOST_EDITS;
    snprintf(stem, sizeof stem, "%.*s", stem_length, title);
    hint[0] = '\0';
    for (int i = 0; mill_deck_table_block(i, &block); i++) {
        name_block(&block, "", word);
        if (!name && (edits = mill_deck_suggest_edits(word, stem)) < best) {
            best = edits;
            name_block(&block, "NAME", word);
            snprintf(hint, size, "; did you mean [%s]?", word);
        }
        name_block(&block, "NAME", word);
        for (const struct mill_key *key = block.key; name && key->name; key++) {
            if (!mill_deck_table_belongs(&block, title)) {
                if (!hint[0] && strcmp(key->name, name) == 0)
                    snprintf(hint, size, "; '%s' belongs to [%s]", name, word);
            } else if ((edits = mill_deck_suggest_edits(key->name, name)) < best) {
                best = edits;
                snprintf(hint, size, "; did you mean '%s'?", key->name);
            }
        }
    }
}
