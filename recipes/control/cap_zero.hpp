#pragma once
// From where the caps on force and torque count.
//
// They are for what the probe does to cloth and sensor. Until the sensor has taken a zero its
// readings hold the weight of what is mounted on it too, which may be over a cap by itself, and
// hides a load of the other sign. So they count from the reading of the bench at rest, the probe
// up: at the start, and again once people have been at the plate. From the sensor's zero on they
// count from that. Whether the sensor bears all of its load is its own rating's business
// (Guard::invalid_wrench), which is looked at whatever counts here.

#include <array>
#include <optional>

namespace weft::recipes {

struct Load {
  std::array<double, 3> force_n{};
  std::array<double, 3> torque_nm{};
};

class CapZero {
 public:
  /// The sensor has been asked for its zero; whether and when it takes it only its readings tell.
  void asked() { asked_ = true; }
  /// It has: readings are loads.
  void taken() { zeroed_ = true; }
  /// One cycle: what the caps judge of a reading. `people_at_plate`: stages at rest, probe up.
  Load step(const Load& reading, bool people_at_plate);

 private:
  bool asked_ = false;
  bool zeroed_ = false;
  std::optional<Load> at_rest_;
};

}  // namespace weft::recipes
