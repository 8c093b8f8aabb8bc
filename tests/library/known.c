/* SPDX-License-Identifier: GPL-2.0-or-later
 * What lobatto.h tells of a scene, chooses for it and proves of it, called from C99. Prints lines that
 * tests/library/c_test.cpp reads; its arguments: a scene, and a scene that is refused. */
#include <lobatto/lobatto.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void check(int holds, const char* claim) {
    if (holds) return;
    printf("failed: %s\n", claim);
    exit(1);
}

/* Its first bytes, after "NAME: "; then it is freed. */
static void show(const char* name, lobatto_text* text) {
    check(text != NULL && lobatto_text_status(text) == 0, name);
    check(strlen(lobatto_text_message(text)) == 0, "a text that was written has no message");
    printf("%s: %s, file %s\n%.60s\n", name, strlen(lobatto_text_content(text)) > 100 ? "whole" : "short",
           lobatto_text_file(text) == NULL ? "none" : lobatto_text_file(text), lobatto_text_content(text));
    lobatto_text_free(text);
}

static void show_refusal(const char* name, lobatto_text* text) {
    check(text != NULL && lobatto_text_content(text) == NULL && lobatto_text_file(text) == NULL, name);
    printf("%s: status %d, %s\n", name, lobatto_text_status(text), lobatto_text_message(text));
    lobatto_text_free(text);
}

static void show_texts(const lobatto_scene* scene) {
    show("derivation", lobatto_derivation(scene, NULL));
    show("latex", lobatto_derivation_latex(scene, NULL));
    show("json", lobatto_derivation_json(scene, NULL));
    show("check", lobatto_check_json(scene, NULL));
    show("stability", lobatto_stability_json(scene, NULL));
    show("emit", lobatto_emit(scene, NULL));
    show("plain", lobatto_emit_plain(scene, NULL));

    lobatto_settings settings = {0};
    settings.splitting = 6;
    show_refusal("splitting", lobatto_stability_json(scene, &settings));
    settings.points = 4;
    show_refusal("two methods", lobatto_derivation(scene, &settings));
    show_refusal("no scene", lobatto_check_json(NULL, NULL));
}

static void choose(const lobatto_scene* scene) {
    const char* const set[] = {"omega=6", NULL};
    lobatto_settings settings = {0};
    settings.until = "2";
    settings.set = set;
    lobatto_choice* choice = lobatto_tune(scene, 1e-4, &settings, 10);
    check(lobatto_choice_status(choice) == 0, lobatto_choice_message(choice));
    const lobatto_settings* chosen = lobatto_choice_settings(choice);
    check(chosen != NULL && strcmp(chosen->set[0], "omega=6") == 0 && chosen->set[1] == NULL, "what was set stays set");
    check(strcmp(chosen->until, "2") == 0 && lobatto_choice_step(choice) == atof(chosen->step), "step and end");
    check((chosen->points != 0) + (chosen->stages != 0) + (chosen->splitting != 0) == 1, "one method");
    check(lobatto_choice_predicted_error(choice) <= 1e-4 && lobatto_choice_seconds(choice) > 0, "error and cost");
    lobatto_trajectory* run = lobatto_run(scene, chosen, 1);
    check(lobatto_trajectory_status(run) == 0 && lobatto_trajectory_error(run) < 3e-4, "the promise is kept");
    printf("chosen: %s\n", lobatto_choice_method(choice));
    lobatto_trajectory_free(run);
    lobatto_choice_free(choice);

    choice = lobatto_tune(scene, 0.9, NULL, 3);
    check(lobatto_choice_settings(choice) == NULL && lobatto_choice_method(choice) == NULL, "a search that failed");
    printf("too much: status %d, %s\n", lobatto_choice_status(choice), lobatto_choice_message(choice));
    lobatto_choice_free(choice);
}

static void prove(const lobatto_scene* scene) {
    lobatto_proof* proof = lobatto_verify(scene, NULL);
    check(lobatto_proof_status(proof) == 0, lobatto_proof_message(proof));
    const size_t count = lobatto_proof_count(proof);
    check(count > 5, "there are claims");
    for (size_t i = 0; i < count; ++i) {
        check(lobatto_proof_holds(proof, i) == 1, lobatto_proof_claim(proof, i));
        check(strlen(lobatto_proof_claim(proof, i)) > 0 && strlen(lobatto_proof_measured(proof, i)) > 0 &&
                  lobatto_proof_bound(proof, i) != NULL && lobatto_proof_meaning(proof, i) != NULL,
              "a claim has words");
    }
    check(lobatto_proof_holds(proof, count) == 0 && lobatto_proof_claim(proof, count) == NULL, "past the last claim");
    printf("proof: all hold\n");
    lobatto_proof_free(proof);

    proof = lobatto_verify(NULL, NULL);
    check(lobatto_proof_count(proof) == 0, "nothing is claimed of no scene");
    printf("no scene proved: status %d, %s\n", lobatto_proof_status(proof), lobatto_proof_message(proof));
    lobatto_proof_free(proof);
}

int main(int argc, char** argv) {
    if (argc != 3) return 2;
    lobatto_scene* scene = lobatto_scene_read(argv[1]);
    check(lobatto_scene_status(scene) == 0, lobatto_scene_message(scene));
    show_texts(scene);
    choose(scene);
    prove(scene);
    lobatto_scene_free(scene);

    scene = lobatto_scene_read(argv[2]);
    show_refusal("constrained", lobatto_stability_json(scene, NULL));
    lobatto_scene_free(scene);
    return 0;
}
