#include "recipes/engine/layout.hpp"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "recipes/engine/motion.hpp"

namespace weft::recipes {
namespace {

std::string mm(double metres) {
  return nlohmann::json(std::round(metres * 1e6) / 1e3).dump() + " mm";
}

/// One direction of the plate, with what the messages need to say.
struct Direction {
  const char* name;
  const char* key;
  double Vec2::*part;
  Axis axis;
};
constexpr Direction directions[]{{"x", "dx_mm", &Vec2::x_m, Axis::x},
                                 {"y", "dy_mm", &Vec2::y_m, Axis::y}};

/// The rig as if its stages went anywhere.
RigLimits without_ends(RigLimits limits) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  limits.geometry.travel.fill({-inf, inf});
  return limits;
}

/// Which contact points the stage's travel reaches. With the rotary stages at their level, which
/// shift and foreshorten it, a stage's position is still linear in the point: two tell it all.
Range reached(const RigLimits& limits, const Direction& direction) {
  const RigLimits free = without_ends(limits);
  Vec2 far;
  far.*direction.part = limits.geometry.plate_size_m.*direction.part;
  const double from = over(free, {}, limits.clearance_m).value()[direction.axis];
  const double to = over(free, far, limits.clearance_m).value()[direction.axis];
  const double slope = (to - from) / (far.*direction.part);
  const auto point = [&](double stage) { return (stage - from) / slope; };
  const Range& travel = limits.geometry.travel[index(direction.axis)];
  return {point(travel.min), point(travel.max)};
}

/// Where the contact point may go along one direction of the fabric frame.
Range allowed(const RigLimits& limits, const Direction& direction) {
  const double half_face = limits.footprint_m.*direction.part / 2;
  const double size = limits.geometry.plate_size_m.*direction.part;
  const Range by_travel = reached(limits, direction);
  return {std::max(half_face, by_travel.min), std::min(size - half_face, by_travel.max)};
}

/// Extent of the path relative to its start.
Range extent(const std::vector<Vec2>& path, const Direction& direction) {
  Range range;
  for (const Vec2& corner : path) {
    range.min = std::min(range.min, corner.*direction.part);
    range.max = std::max(range.max, corner.*direction.part);
  }
  return range;
}

std::string room_hint(const Range& room) {
  return "the probe's face must stay on the plate and the stage within its travel: " +
         mm(room.min) + " to " + mm(room.max);
}

/// Centres the path in the room there is; true when it fits.
bool check_centred(const Direction& direction, const Range& room, const Range& path,
                   StatedExploration& stated, Problems& problems) {
  stated.exploration.start_m.*direction.part = (room.min + room.max - path.min - path.max) / 2;
  if (path.width() <= room.width() + travel_rounding) return true;
  problems.add({stated.path_pointer, std::string("the path is too long along ") + direction.name,
                "at most " + mm(std::max(0.0, room.width())), mm(path.width()), room_hint(room)});
  return false;
}

/// True when the path stays in the room there is.
bool check_start(const Direction& direction, const Range& room, const Range& path,
                 const StatedExploration& stated, Problems& problems) {
  const double start = stated.exploration.start_m.*direction.part;
  const Range reached{start + path.min, start + path.max};
  if (within(room, reached)) return true;
  problems.add({stated.path_pointer,
                std::string("the path leaves the plate or the travel along ") + direction.name,
                mm(room.min) + " to " + mm(room.max), mm(reached.min) + " to " + mm(reached.max),
                "move its start or shorten " + std::string(direction.key)});
  return false;
}

/// With the rotary stages at their level z follows the plate along the path.
void check_height(const StatedExploration& stated, const RigLimits& limits, Problems& problems) {
  const RigLimits free = without_ends(limits);
  const Exploration& exploration = stated.exploration;
  const auto z_over = [&](Vec2 point) {
    return over(free, point, limits.clearance_m).value()[Axis::z];
  };
  const double start_z = z_over(exploration.start_m);
  Range used{start_z, start_z};
  for (std::size_t i = 0; i < exploration.path_m().size(); ++i) {
    const double z = z_over(path_leg(exploration, i).to_m);
    used = {std::min(used.min, z), std::max(used.max, z)};
  }
  const Range& travel = limits.geometry.travel[index(Axis::z)];
  if (within(travel, used)) return;
  problems.add({stated.path_pointer,
                "the path leaves the travel of z where the rotary stages are at the rig's level",
                mm(travel.min) + " to " + mm(travel.max), mm(used.min) + " to " + mm(used.max),
                "move its start, or level the plate by hand first"});
}

}  // namespace

void place_on_plate(StatedExploration& stated, const RigLimits& limits, Problems& problems) {
  if (stated.path_pointer.empty()) return;  // already refused
  Exploration& exploration = stated.exploration;
  if (stated.start_m) exploration.start_m = *stated.start_m;
  const std::vector<Vec2>& corners = exploration.path_m();
  bool fits = true;
  for (const Direction& direction : directions) {
    const Range room = allowed(limits, direction);
    const Range path = extent(corners, direction);
    fits &= stated.start_m ? check_start(direction, room, path, stated, problems)
                           : check_centred(direction, room, path, stated, problems);
  }
  if (fits) check_height(stated, limits, problems);  // beyond the room z goes nowhere
}

}  // namespace weft::recipes
