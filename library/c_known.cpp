// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto.h on lobatto.hpp: what is known of a scene, what is chosen for it, what is proved of it.
#include <cmath>

#include "library/handles.hpp"

namespace {

namespace api = lobatto::api;

// A file name, where there is one, and the text.
using NamedText = std::pair<std::string, std::string>;

}  // namespace

struct lobatto_text : api::Handle<NamedText> {};

struct lobatto_choice : api::Handle<api::Choice> {
    std::vector<std::string> set_texts;  // what `settings` points to, with value
    std::vector<const char*> set_pointers;
    lobatto_settings settings{};
    void show_settings();
};

struct lobatto_proof : api::Handle<std::vector<api::Claim>> {};

void lobatto_choice::show_settings() {
    const api::Settings& found = value->settings;
    const auto word = [](const std::string& text) { return text.empty() ? nullptr : text.c_str(); };
    settings.points = found.points.value_or(0);
    settings.stages = found.stages.value_or(0);
    settings.splitting = found.splitting.value_or(0);
    settings.tolerance = found.tolerance.value_or(0);
    settings.arithmetic = word(found.arithmetic);
    settings.numbers = word(found.numbers);
    settings.clock = word(found.clock);
    settings.step = word(found.step);
    settings.until = word(found.until);
    settings.every = found.every.value_or(0);
    for (const auto& [name, formula] : found.set) set_texts.push_back(name + "=" + formula);
    for (const std::string& text : set_texts) set_pointers.push_back(text.c_str());
    set_pointers.push_back(nullptr);
    settings.set = set_pointers.data();
}

namespace {

using Writer = std::string (api::Scene::*)(const api::Settings&) const;
using CodeWriter = NamedText (api::Scene::*)(const api::Settings&) const;

lobatto_text* written(const lobatto_scene* scene, const lobatto_settings* settings, Writer writer) {
    return api::made<lobatto_text>([&](lobatto_text& text) {
        text.value.emplace("", (api::scene_of(scene).*writer)(api::settings_of(settings)));
    });
}

lobatto_text* written(const lobatto_scene* scene, const lobatto_settings* settings, CodeWriter writer) {
    return api::made<lobatto_text>(
        [&](lobatto_text& text) { text.value = (api::scene_of(scene).*writer)(api::settings_of(settings)); });
}

const api::Claim* claim_of(const lobatto_proof* proof, std::size_t index) {
    return api::read(proof, nullptr, [&](const auto& value) { return api::element(value, index); });
}

}  // namespace

extern "C" {

lobatto_text* lobatto_derivation(const lobatto_scene* scene, const lobatto_settings* settings) {
    return written(scene, settings, &api::Scene::derivation);
}
lobatto_text* lobatto_derivation_latex(const lobatto_scene* scene, const lobatto_settings* settings) {
    return written(scene, settings, &api::Scene::derivation_latex);
}
lobatto_text* lobatto_derivation_json(const lobatto_scene* scene, const lobatto_settings* settings) {
    return written(scene, settings, &api::Scene::derivation_json);
}
lobatto_text* lobatto_check_json(const lobatto_scene* scene, const lobatto_settings* settings) {
    return written(scene, settings, &api::Scene::check_json);
}
lobatto_text* lobatto_stability_json(const lobatto_scene* scene, const lobatto_settings* settings) {
    return written(scene, settings, &api::Scene::stability_json);
}
lobatto_text* lobatto_emit(const lobatto_scene* scene, const lobatto_settings* settings) {
    return written(scene, settings, &api::Scene::emit);
}
lobatto_text* lobatto_emit_plain(const lobatto_scene* scene, const lobatto_settings* settings) {
    return written(scene, settings, &api::Scene::emit_plain);
}
void lobatto_text_free(lobatto_text* text) {
    delete text;
}
int lobatto_text_status(const lobatto_text* text) {
    return api::status_of(text);
}
const char* lobatto_text_message(const lobatto_text* text) {
    return api::message_of(text);
}
const char* lobatto_text_content(const lobatto_text* text) {
    return api::read(text, nullptr, [](const auto& value) { return value.second.c_str(); });
}
const char* lobatto_text_file(const lobatto_text* text) {
    return api::read(text, nullptr,
                     [](const auto& value) { return value.first.empty() ? nullptr : value.first.c_str(); });
}

lobatto_choice* lobatto_tune(const lobatto_scene* scene, double error, const lobatto_settings* settings,
                             double budget) {
    return api::made<lobatto_choice>([&](lobatto_choice& choice) {
        choice.value = api::tune(api::scene_of(scene), error, api::settings_of(settings), budget);
        choice.show_settings();
    });
}
void lobatto_choice_free(lobatto_choice* choice) {
    delete choice;
}
int lobatto_choice_status(const lobatto_choice* choice) {
    return api::status_of(choice);
}
const char* lobatto_choice_message(const lobatto_choice* choice) {
    return api::message_of(choice);
}
const lobatto_settings* lobatto_choice_settings(const lobatto_choice* choice) {
    return choice != nullptr && choice->value ? &choice->settings : nullptr;
}
const char* lobatto_choice_method(const lobatto_choice* choice) {
    return api::read(choice, nullptr, [](const auto& value) { return value.method.c_str(); });
}
double lobatto_choice_step(const lobatto_choice* choice) {
    return api::read(choice, 0, [](const auto& value) { return value.step; });
}
double lobatto_choice_predicted_error(const lobatto_choice* choice) {
    return api::read(choice, std::nan(""), [](const auto& value) { return value.predicted_error; });
}
double lobatto_choice_seconds(const lobatto_choice* choice) {
    return api::read(choice, 0, [](const auto& value) { return value.seconds; });
}
int lobatto_choice_complete(const lobatto_choice* choice) {
    return api::read(choice, 0, [](const auto& value) { return value.complete ? 1 : 0; });
}

lobatto_proof* lobatto_verify(const lobatto_scene* scene, const lobatto_settings* settings) {
    return api::made<lobatto_proof>(
        [&](lobatto_proof& proof) { proof.value = api::verify(api::scene_of(scene), api::settings_of(settings)); });
}
void lobatto_proof_free(lobatto_proof* proof) {
    delete proof;
}
int lobatto_proof_status(const lobatto_proof* proof) {
    return api::status_of(proof);
}
const char* lobatto_proof_message(const lobatto_proof* proof) {
    return api::message_of(proof);
}
size_t lobatto_proof_count(const lobatto_proof* proof) {
    return api::read(proof, 0, [](const auto& value) { return value.size(); });
}
int lobatto_proof_holds(const lobatto_proof* proof, size_t index) {
    const api::Claim* const found = claim_of(proof, index);
    return found != nullptr && found->holds ? 1 : 0;
}
const char* lobatto_proof_claim(const lobatto_proof* proof, size_t index) {
    const api::Claim* const found = claim_of(proof, index);
    return found == nullptr ? nullptr : found->claim.c_str();
}
const char* lobatto_proof_measured(const lobatto_proof* proof, size_t index) {
    const api::Claim* const found = claim_of(proof, index);
    return found == nullptr ? nullptr : found->measured.c_str();
}
const char* lobatto_proof_bound(const lobatto_proof* proof, size_t index) {
    const api::Claim* const found = claim_of(proof, index);
    return found == nullptr ? nullptr : found->bound.c_str();
}
const char* lobatto_proof_meaning(const lobatto_proof* proof, size_t index) {
    const api::Claim* const found = claim_of(proof, index);
    return found == nullptr ? nullptr : found->meaning.c_str();
}

}  // extern "C"
