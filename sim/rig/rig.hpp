#pragma once
// A rig file turned into emulated devices around one plant. The daemon gives each emulator the far
// end of a link and a loop; nothing here reads a clock. Frames and signs: sim/README.md.

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

/// What no instrument of the rig can know. For tests, reports and figures only. Of a rig without
/// force sensor and pads nothing is computed but where the stages are: the rest is NaN.
struct Truth {
  double contact_force_n = 0;  ///< normal force of the probe on the cloth, >= 0
  double indentation_m = 0;    ///< of the face's centre into the cloth; negative above it
  double probe_z_m = 0;        ///< height of the face's centre, downwards, in the z stage's scale
  std::array<double, 2> fabric_point_m{};  ///< the face's centre in the fabric frame
  std::array<double, 2> friction_n{};      ///< force on the cloth along the fabric frame's x and y
  std::array<double, 16> pad_pressure_pa{};  ///< each pad at its own last conversion
};

/// The simulated bench: emulators in, bytes out. Bound to the thread of the loops it is attached
/// to.
class Rig {
 public:
  /// `rig_json` is a whole rig file (its keys `probe`, `plate`, `simulation` and each device's
  /// `emulator` are read here), `fabrics_json` the cloth table (sim/fabrics.json). Two rigs of one
  /// seed are the same sensor with the same noise; another seed is another sensor.
  static Result<std::unique_ptr<Rig>> create(std::string_view rig_json,
                                             std::string_view fabrics_json, std::uint64_t seed);
  ~Rig();

  /// Switches the device `device_name` of the rig file on, at `loop.now()`: what arrives on
  /// `device_end` is fed to its emulator, what that answers is written there. A device can be
  /// attached again (power cycle); the last link wins. The link must outlive the rig or the loop's
  /// last callback.
  Status attach(std::string_view device_name, Link& device_end, Loop& loop);

  /// The HTTP port of a Net F/T box for one client. Errors: not_found, unsupported (a device
  /// without pages).
  Status attach_page(std::string_view device_name, Link& device_end, Loop& loop);
  /// The same for a port that takes connections: an emulator for each. nullptr: no pages.
  std::unique_ptr<ClientEmulator> page(std::string_view device_name);
  /// The TCP command port of a Net F/T box, for one connection. nullptr: the device has none.
  std::unique_ptr<ClientEmulator> command_port(std::string_view device_name);
  /// Whether a datagram makes its sender the one whom the device answers: the box's stream follows
  /// the latest start request, and nothing else.
  [[nodiscard]] bool redirects(std::string_view device_name, ByteView datagram) const;
  /// Whether several hosts may speak to the device at once over TCP: Modbus TCP tells answers apart
  /// by transaction and connection (MODBUS Messaging on TCP/IP 1.0b, 4.2.2); an APT stage has one
  /// host.
  [[nodiscard]] bool serves_many(std::string_view device_name) const;
  /// Whether anybody can hear what the device sends; from attach() on it is so. Taxels and a
  /// vibration sensor that nobody hears, and that no fault befalls, schedule nothing and make no
  /// frames; once heard, by this or by bytes that arrive, they go on as if they had sent all along.
  /// An imprint array goes on: its cover remembers every scan. Nothing happens for a device that is
  /// not attached.
  void set_connected(std::string_view device_name, bool connected);
  /// While nobody hears a device the plant moves by this alone: called now and then, it keeps short
  /// what has to be made up for when a host comes.
  void keep_up(TimePoint now);
  /// Another host has the device's place. Nothing happens for a device that is not attached.
  void meet_new_host(std::string_view device_name);

  /// Puts a piece of `fabric` on the plate, drawn from the seeds of piece and mounting, and touches
  /// it. Where that is what lies there already, cloth and pads remember the touches before; of
  /// another `patch` the cloth is fresh. The same order is the same cloth on every rig.
  Status mount(std::string_view fabric, const PatchSeeds& seeds, std::uint32_t patch,
               TimePoint now);
  /// The same with all from one seed, and no memory of what was there before.
  Status mount(std::string_view fabric, std::uint64_t seed, TimePoint now);
  /// Leaves the bare plate, which is stiff and smooth.
  Status unmount(TimePoint now);

  /// Lets a fault befall a device. `order` is one entry of the rig file's `simulation.faults`, a
  /// JSON object whose `start_s` counts from `now`. Kinds: sim/devices/faults/fault.cpp.
  Status inject(std::string_view order, TimePoint now);
  /// Ends the faults of one kind, or all when `fault` is empty, of one device.
  /// Errors: not_found (device, kind).
  Status clear_faults(std::string_view device_name, std::string_view fault);
  /// The device's plug is in: no `unplug` holds at `now`. The emulators' wires pass nothing then;
  /// who serves ports also shows hosts that they are gone. True for an unknown name.
  [[nodiscard]] bool plugged(std::string_view device_name, TimePoint now) const;
  /// Where the motors of x, y, z [m], rx and ry [rad] truly are, from each stage's own zero.
  [[nodiscard]] std::array<double, 5> stage_positions(TimePoint now) const;

  /// Samples a second that the emulator of `device_name` streams by itself; nothing for a stage,
  /// which speaks when spoken to, and for an unknown name.
  [[nodiscard]] std::optional<double> stream_rate_hz(std::string_view device_name) const;
  /// Names that mount() knows, in the table's order.
  [[nodiscard]] std::vector<std::string> fabrics() const;
  /// State of the plant at `now`, which must not lie before the last call of any kind.
  [[nodiscard]] Truth truth(TimePoint now);

  /// From the next mount() on, the stages' motion is kept, or not any more.
  void record_motion(bool on);
  /// The motion since the last mount(), where it was kept, up to `now`; it is kept no longer.
  std::optional<BenchMotion> extract_motion(TimePoint now);
  /// How far this rig's simulation of a motion is from a finer one (sim/devices/replay.hpp).
  /// `sampled` and `accuracy_n`: see run_error() there.
  [[nodiscard]] RunError run_error(const BenchMotion& motion, const SampleTimes& sampled = {},
                                   std::optional<double> accuracy_n = {}) const;
  /// For replays: of what all levels simulate.
  [[nodiscard]] const PlantParams& plant_params() const;
  [[nodiscard]] std::uint64_t seed() const;

 private:
  struct Parts;
  explicit Rig(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace weft::sim
