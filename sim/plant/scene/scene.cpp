#include "sim/plant/scene/scene.hpp"

#include <algorithm>
#include <string>

namespace weft::sim {
namespace {

struct LevelName {
  Level level;
  std::string_view name;
};
constexpr LevelName level_names[] = {{Level::z, "Z"},          {Level::z_plus, "Z+"},
                                     {Level::algebraic, "L0"}, {Level::quasistatic, "L1"},
                                     {Level::dynamic, "L2"},   {Level::modal, "L3"}};

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
        Errc::unsupported,
        "level " + std::string(to_string(level)) + " cannot produce " + std::string(to_string(w)),
        "scene " + std::string(scene.name), needs, std::string(to_string(level)),
        "Choose that level or leave the channel out of the scene");
  }
  return {};
}

}  // namespace

std::string_view to_string(Level level) {
  return std::find_if(std::begin(level_names), std::end(level_names),
                      [&](const LevelName& n) { return n.level == level; })
      ->name;
}

Result<Level> level_from(std::string_view text) {
  for (const LevelName& n : level_names)
    if (n.name == text) return n.level;
  return fail(Errc::invalid_argument, "no such level of fidelity", "level",
              "Z, Z+, L0, L1, L2 or L3", std::string(text));
}

std::string_view to_string(Channel channel) {
  switch (channel) {
    case Channel::stages:
      return "stage positions";
    case Channel::wrench:
      return "a wrench";
    case Channel::taxels:
      return "taxel counts";
    case Channel::accelerometer:
      return "acceleration";
    case Channel::microphone:
      return "sound";
    case Channel::imprint:
      return "an imprint";
  }
  return "?";
}

std::string_view to_string(Trait trait) {
  switch (trait) {
    case Trait::mean_level:
      return "mean levels";
    case Trait::relaxation:
      return "relaxation";
    case Trait::regulated_force:
      return "a regulated force";
    case Trait::overshoot:
      return "overshoot at touch-down";
    case Trait::stick_slip:
      return "stick-slip";
    case Trait::neighbour_load:
      return "load shared between neighbours";
  }
  return "?";
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
  return fail(Errc::unsupported, "no level produces all that the scene asks for",
              "scene " + std::string(scene.name), {}, {},
              "Static imprints and moving sensors are two scenes");
}

Status check(const Scene& scene, Level level) {
  if (auto ok = check_each(scene.channels, scene, level); !ok) return ok;
  return check_each(scene.traits, scene, level);
}

}  // namespace weft::sim
