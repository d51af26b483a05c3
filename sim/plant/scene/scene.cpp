#include "sim/plant/scene/scene.hpp"

#include <algorithm>
#include <string>

#include "protocols/base/names.hpp"

namespace weft::sim {
namespace {

constexpr NameTable<Level, 6> level_names = {{
    {Level::z, "Z"},
    {Level::z_plus, "Z+"},
    {Level::algebraic, "L0"},
    {Level::quasistatic, "L1"},
    {Level::dynamic, "L2"},
    {Level::modal, "L3"},
}};

constexpr NameTable<Channel, 6> channel_names = {{
    {Channel::stages, "stage positions"},
    {Channel::wrench, "a wrench"},
    {Channel::taxels, "taxel counts"},
    {Channel::accelerometer, "acceleration"},
    {Channel::microphone, "sound"},
    {Channel::imprint, "an imprint"},
}};

template <class Wanted>
bool some_level_provides(Wanted wanted, Level& least) {
  for (const Level level : all_levels) {
    if (!provides(level, wanted)) continue;
    least = level;
    return true;
  }
  return false;
}

template <class Wanted>
Status check_each(const std::vector<Wanted>& wanted, const Scene& scene, Level level) {
  for (const Wanted w : wanted) {
    if (provides(level, w)) continue;
    Level least{};
    const std::string needs =
        some_level_provides(w, least) ? std::string(to_string(least)) + " or above" : "nothing";
    return fail(
        {.code = Errc::unsupported,
         .where = "scene " + std::string(scene.name),
         .what = std::string(to_string(w)) + " not available at this level",
         .expected = needs,
         .got = std::string(to_string(level)),
         .hint = "Choose the expected level, or remove the channel or trait from the scene"});
  }
  return {};
}

struct TraitName {
  Trait trait;
  std::string_view name, words;
};
constexpr TraitName trait_names[] = {
    {Trait::mean_level, "mean_level", "mean levels"},
    {Trait::relaxation, "relaxation", "relaxation"},
    {Trait::regulated_force, "regulated_force", "a regulated force"},
    {Trait::overshoot, "overshoot", "overshoot at touch-down"},
    {Trait::stick_slip, "stick_slip", "stick-slip"},
    {Trait::neighbour_load, "neighbour_load", "load shared between neighbours"}};

const TraitName& entry_of(Trait trait) {
  return *std::find_if(std::begin(trait_names), std::end(trait_names),
                       [&](const TraitName& n) { return n.trait == trait; });
}

std::string listed(const std::vector<std::string_view>& words) {
  std::string out;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) out += i + 1 == words.size() ? " and " : ", ";
    out += words[i];
  }
  return out;
}

}  // namespace

std::string_view to_string(Level level) {
  return name_in(level_names, level);
}

Result<Level> level_from(std::string_view text) {
  if (const auto level = value_in(level_names, text)) return *level;
  return fail({.code = Errc::invalid_argument,
               .where = "level",
               .what = "fidelity level unknown",
               .expected = "Z, Z+, L0, L1, L2 or L3",
               .got = std::string(text)});
}

std::string_view to_string(Channel channel) {
  return name_in(channel_names, channel);
}

std::string_view to_string(Trait trait) {
  return entry_of(trait).words;
}

std::string_view name_of(Trait trait) {
  return entry_of(trait).name;
}

Result<Trait> trait_from(std::string_view name) {
  std::vector<std::string_view> known;
  for (const TraitName& n : trait_names) {
    if (n.name == name) return n.trait;
    known.push_back(n.name);
  }
  return fail({.code = Errc::invalid_argument,
               .where = "trait",
               .what = "trait unknown",
               .expected = listed(known),
               .got = std::string(name)});
}

bool is_needed(const Scene& scene, Channel channel) {
  return std::find(scene.channels.begin(), scene.channels.end(), channel) != scene.channels.end();
}

bool is_needed(const Scene& scene, Trait trait) {
  return std::find(scene.traits.begin(), scene.traits.end(), trait) != scene.traits.end();
}

std::string format_needs(const Scene& scene) {
  std::vector<std::string_view> words;
  for (const Channel channel : scene.channels)
    if (channel != Channel::stages) words.push_back(to_string(channel));
  for (const Trait trait : scene.traits) words.push_back(to_string(trait));
  return words.empty() ? std::string(to_string(Channel::stages)) : listed(words);
}

bool provides(Level level, Channel channel) {
  switch (channel) {
    case Channel::imprint:
      return !moves(level);
    case Channel::accelerometer:
    case Channel::microphone:
      return level == Level::modal;
    case Channel::stages:
    case Channel::wrench:
    case Channel::taxels:
      return moves(level);
  }
  return false;
}

bool provides(Level level, Trait trait) {
  switch (trait) {
    case Trait::mean_level:
      return true;
    case Trait::relaxation:
    case Trait::regulated_force:
      return level >= Level::quasistatic;
    case Trait::overshoot:
    case Trait::stick_slip:
      return level >= Level::dynamic;
    case Trait::neighbour_load:
      return level == Level::z_plus;
  }
  return false;
}

Result<Level> least_level(const Scene& scene) {
  for (const Level level : all_levels)
    if (check(scene, level)) return level;
  return fail({.code = Errc::unsupported,
               .where = "scene " + std::string(scene.name),
               .what = "no level provides all channels and traits of the scene",
               .hint = "Use one scene for static imprints and another for moving sensors"});
}

Status check(const Scene& scene, Level level) {
  if (auto ok = check_each(scene.channels, scene, level); !ok) return ok;
  return check_each(scene.traits, scene, level);
}

}  // namespace weft::sim
