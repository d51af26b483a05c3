#pragma once
// Builds emulated devices around one plant from a rig file. The daemon gives each emulator the far
// end of a link and a loop; no clock is read here. Frames and signs:
// docs/explanation/simulation.md.

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/api/driver.hpp"
#include "drivers/api/timer.hpp"
#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"
#include "sim/devices/replay.hpp"

namespace weft::sim {

class ClientEmulator;  // sim/devices/emulator.hpp

/// State that no instrument of the rig can measure, for tests, reports and figures only. On a rig
/// without force sensor and pads only the stage positions are computed; the rest is NaN.
struct Truth {
  double contact_force_n = 0;  ///< normal force of the probe on the fabric, >= 0
  double indentation_m = 0;    ///< of the face's centre into the fabric; negative above it
  double probe_z_m = 0;        ///< height of the face's centre, downwards, in the z stage's scale
  std::array<double, 2> fabric_point_m{};  ///< the face's centre in the fabric frame
  std::array<double, 2> friction_n{};      ///< force on the fabric along the fabric frame's x and y
  std::array<double, 16> pad_pressure_pa{};  ///< each pad at its own last conversion
};

/// The simulated bench: emulators in, bytes out. Thread: that of the loops to which it is attached.
class Rig {
 public:
  /// `rig_json` is a whole rig file; its keys `probe`, `plate`, `simulation` and each device's
  /// `emulator` are read here. `fabrics_json` is the fabric table (sim/fabrics.json). Two rigs with
  /// one seed have the same sensor with the same noise; another seed gives another sensor.
  static Result<std::unique_ptr<Rig>> create(std::string_view rig_json,
                                             std::string_view fabrics_json, std::uint64_t seed);
  ~Rig();

  /// Switches the device `device_name` of the rig file on at `loop.now()`: bytes from `device_end`
  /// are fed to its emulator, and its answers are written there. A device can be attached again
  /// (power cycle); the last link is used. The link must outlive the rig or the loop's last
  /// callback.
  Status attach(std::string_view device_name, Link& device_end, Loop& loop);

  /// Attaches the HTTP port of a Net F/T box for one client. Errors: not_found, unsupported (a
  /// device without pages).
  Status attach_page(std::string_view device_name, Link& device_end, Loop& loop);
  /// The same for a port that accepts connections: one emulator per connection. nullptr: no pages.
  std::unique_ptr<ClientEmulator> page(std::string_view device_name);
  /// The TCP command port of a Net F/T box, for one connection. nullptr: the device has none.
  std::unique_ptr<ClientEmulator> command_port(std::string_view device_name);
  /// Whether a datagram makes its sender the receiver of the device's answers. Only a start request
  /// does: the box's stream follows the latest one.
  ///
  [[nodiscard]] bool redirects(std::string_view device_name, ByteView datagram) const;
  /// Whether several hosts may use the device at once over TCP. Modbus TCP distinguishes answers by
  /// transaction and connection (MODBUS Messaging on TCP/IP 1.0b, 4.2.2); an APT stage has one
  /// host.
  [[nodiscard]] bool serves_many(std::string_view device_name) const;
  /// Sets whether a host can receive the device's data; true after attach(). Without a host and
  /// without faults, taxels and a vibration sensor schedule nothing and make no frames. Once
  /// connected by this call or by received bytes, they continue as if they had sent all the time.
  /// An imprint array does not rest, because its cover remembers every scan. Does nothing for a
  /// device that is not attached.
  void set_connected(std::string_view device_name, bool connected);
  /// Moves the plant to `now`. While no host receives data, only this moves it: regular calls
  /// shorten the catch-up when a host connects.
  void keep_up(TimePoint now);
  /// Another host has taken over the device. Does nothing for a device that is not attached.
  void meet_new_host(std::string_view device_name);

  /// Mounts a piece of `fabric`, drawn from the seeds of piece and mounting, and touches it. If
  /// that mounting is already there, fabric and pads remember the earlier touches; on another
  /// `patch` the fabric is fresh. Equal arguments give equal fabric on every rig.
  Status mount(std::string_view fabric, const PatchSeeds& seeds, std::uint32_t patch,
               TimePoint now);
  /// The same with all seeds derived from one, and no memory of the former piece.
  Status mount(std::string_view fabric, std::uint64_t seed, TimePoint now);
  /// Leaves the bare plate, which is stiff and smooth.
  Status unmount(TimePoint now);

  /// Injects a fault into a device. `order` is one entry of the rig file's `simulation.faults`, a
  /// JSON object; its `start_s` counts from `now`. Kinds: sim/devices/faults/fault.cpp.
  Status inject(std::string_view order, TimePoint now);
  /// Ends the faults of one kind of one device, or all of them when `fault` is empty.
  /// Errors: not_found (device, kind).
  Status clear_faults(std::string_view device_name, std::string_view fault);
  /// Whether the device's plug is in: no `unplug` fault is active at `now`. Otherwise the
  /// emulator's wire passes no bytes; a server of ports also shows hosts the lost connection. True
  /// for an unknown name.
  [[nodiscard]] bool plugged(std::string_view device_name, TimePoint now) const;
  /// True positions of the motors of x, y, z [m], rx and ry [rad], from each stage's own zero.
  [[nodiscard]] std::array<double, 5> stage_positions(TimePoint now) const;

  /// Samples per second that the emulator of `device_name` streams by itself. Nullopt for a stage,
  /// which only answers, and for an unknown name.
  [[nodiscard]] std::optional<double> stream_rate_hz(std::string_view device_name) const;
  /// Names that mount() accepts, in the order of the table.
  [[nodiscard]] std::vector<std::string> fabrics() const;
  /// State of the plant at `now`, which must not be before the last call of any kind.
  [[nodiscard]] Truth truth(TimePoint now);

  /// Starts or stops keeping the stages' motion, from the next mount() on.
  void record_motion(bool on);
  /// The motion from the last mount() to `now`, if it was kept; keeping ends.
  std::optional<BenchMotion> extract_motion(TimePoint now);
  /// Difference of this rig's simulation of a motion from a finer one (sim/devices/replay.hpp).
  /// `sampled` and `accuracy_n`: see run_error() there.
  [[nodiscard]] RunError run_error(const BenchMotion& motion, const SampleTimes& sampled = {},
                                   std::optional<double> accuracy_n = {}) const;
  /// For replays: the parameters of all levels.
  [[nodiscard]] const PlantParams& plant_params() const;
  [[nodiscard]] std::uint64_t seed() const;

 private:
  struct Parts;
  explicit Rig(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace weft::sim
