#include "sim/plant/stage.hpp"

#include <algorithm>
#include <cmath>

namespace weft::sim {

void Stage::adopt(const Profile& profile, TimePoint now) {
  settle(now);
  profile_ = profile;
  start_ = now;
  // One tick later than the rounded end: the profile has ended for certain.
  end_ = profile.duration_s() > 0 ? now + from_seconds(profile.duration_s()) + Duration(1) : now;
}

void Stage::move_to(double target, const MotionLimits& limits, TimePoint now) {
  const double inside = std::clamp(target, params_.low, params_.high);
  adopt(Profile::to_target(position(now), velocity(now), inside, limits), now);
}

void Stage::stop(double acceleration, TimePoint now) {
  if (acceleration > 0)
    adopt(Profile::to_rest(position(now), velocity(now), acceleration), now);
  else
    adopt(Profile(position(now)), now);
}

double Stage::dragged(TimePoint t) const {
  const double motor = position(t), half_play = params_.backlash / 2;
  return std::clamp(carriage_, motor - half_play, motor + half_play);
}

double Stage::carriage(TimePoint t) const {
  const double exact = dragged(t);
  return params_.quantum > 0 ? params_.quantum * std::round(exact / params_.quantum) : exact;
}

}  // namespace weft::sim
