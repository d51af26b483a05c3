#pragma once
// A dense array of taxels pressed on an object. From power-on it sends a scan of the requested part
// at every period and a description once a second. The normal force is that of the bench's contact;
// its distribution on the array is the static press of levels Z and Z+ (sim/plant/imprint).

#include <array>
#include <cstdint>
#include <optional>

#include "protocols/imprint/imprint.hpp"
#include "sim/devices/bench_plant.hpp"
#include "sim/devices/emulator.hpp"
#include "sim/plant/imprint/half_space.hpp"
#include "sim/plant/imprint/height_map.hpp"
#include "sim/plant/imprint/objects.hpp"
#include "sim/plant/scene/scene.hpp"

namespace weft::sim {

struct ImprintEmulatorParams {
  Level level = Level::z_plus;  ///< z or z_plus
  TaxelParams taxels;           ///< of 7 bits
  std::int64_t period_ns = 200'000'000;
  std::uint32_t serial = 86000001;
  std::array<std::uint8_t, 3> firmware{1, 2, 3};
  /// Frames are cut into random pieces of 1 to this number of bytes; 0 sends them whole.
  std::size_t largest_chunk_bytes = 0;
  std::uint64_t seed = 0;  ///< for noise and pieces
};

/// The object on the plate under the whole array, at any force.
class PressedFace {
 public:
  explicit PressedFace(Level level) : level_(level) {}

  /// Places `object`, with the position drawn from `seed`. Errors: range, from `place`.
  Status lay(const ObjectSpec& object, std::uint64_t seed);
  /// The imprint of the whole array. A force within a thousandth of the last one returns the last
  /// imprint; the difference is less than the noise of any taxel. Errors: those of the press.
  Result<const Imprint*> press(double force_n);

 private:
  Level level_;
  HeightMap map_;
  SpringLaw bed_;
  std::optional<HalfSpace> half_space_;  ///< for Z+
  double modulus_pa_ = 0;                ///< for which half_space_ was made
  double pressed_n_ = -1;                ///< < 0: no press yet
  Imprint imprint_;
};

class ImprintEmulator final : public FrameEmulator {
 public:
  /// `bench_plant` must outlive the emulator. Powered on at `now`: the first scan ends one period
  /// later.
  ImprintEmulator(const ImprintEmulatorParams& params, BenchPlant& bench_plant, TimePoint now);

  void receive(ByteView bytes, TimePoint now, ByteSink& out) override;
  [[nodiscard]] std::optional<TimePoint> next_wakeup() const override;

 private:
  void act(TimePoint at, ByteSink& out) override;
  void send_description(TimePoint at, ByteSink& out);
  void send_scan(TimePoint at, ByteSink& out);
  [[nodiscard]] Result<TaxelFrame> read(TimePoint at);
  [[nodiscard]] Status image_plate();
  void apply_number_faults(TimePoint at);
  void apply_faults(protocols::imprint::Frame& frame, TimePoint at);

  ImprintEmulatorParams params_;
  BenchPlant* bench_plant_;
  TimePoint next_description_, next_scan_;
  std::uint64_t scans_ = 0;  ///< since power-on
  std::uint16_t sequence_ = 0, descriptions_ = 0;
  protocols::imprint::Splitter requests_;
  protocols::imprint::Frame request_;
  protocols::imprint::Window window_;
  PressedFace face_;
  std::uint64_t seen_mounts_;  ///< mount count of the plant to which `face_` belongs
  CoverState cover_;           ///< state of the window
  std::optional<protocols::imprint::Frame> frozen_;  ///< by a fault
};

}  // namespace weft::sim
