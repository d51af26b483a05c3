#include "recipes/control/cap_zero.hpp"

#include <cmath>

namespace weft::recipes {
namespace {

double size_n(const Load& load) {
  return std::hypot(load.force_n[0], load.force_n[1], load.force_n[2]);
}

Load difference(const Load& a, const Load& b) {
  Load out;
  for (std::size_t i = 0; i < 3; ++i) {
    out.force_n[i] = a.force_n[i] - b.force_n[i];
    out.torque_nm[i] = a.torque_nm[i] - b.torque_nm[i];
  }
  return out;
}

}  // namespace

Load CapZero::step(const Load& reading, bool people_at_plate) {
  if (people_at_plate) {
    asked_ = zeroed_ = false;
    at_rest_ = reading;
  }
  if (zeroed_) return reading;
  if (!at_rest_) at_rest_ = reading;
  const Load since_rest = difference(reading, *at_rest_);
  // Nearer to zero than to the load at rest: the zero has been taken, and there is no way back.
  zeroed_ = asked_ && size_n(reading) < size_n(since_rest);
  return zeroed_ ? reading : since_rest;
}

}  // namespace weft::recipes
