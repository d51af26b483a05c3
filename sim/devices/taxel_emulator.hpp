#pragma once
// Microcontroller of the tactile sensor. From power-on it sends a frame of protocols/taxel at the
// end of every scan, without requests.

#include <cstdint>

#include "protocols/taxel/taxel.hpp"
#include "sim/devices/bench_plant.hpp"
#include "sim/devices/emulator.hpp"
#include "sim/devices/pad_resampler.hpp"

namespace weft::sim {

enum class TaxelWire : std::uint8_t {
  weft,     ///< frames over a serial line
  cpm_udp,  ///< the datagrams of a CPM-Finger's gateway: 16 counts only
};

struct TaxelEmulatorParams {
  /// Frames are cut into random pieces of 1 to this number of bytes; 0 sends them whole.
  std::size_t largest_chunk_bytes = 0;
  std::uint64_t chunk_seed = 0;
  TaxelWire wire = TaxelWire::weft;
  /// Taxels of another array, at most protocols::taxel::max_taxels; empty: the plant's 16 pads.
  std::vector<TaxelPlace> places = {};
  std::int64_t period_ns = pad_timing::frame_ns;
  double noise_counts = 1;  ///< of each taxel, with `places`
};

class TaxelEmulator final : public FrameEmulator {
 public:
  /// `bench_plant` must outlive the emulator. Powered on at `now`: the first frame is the first
  /// whole scan.
  TaxelEmulator(const TaxelEmulatorParams& params, BenchPlant& bench_plant, TimePoint now);

  [[nodiscard]] std::optional<TimePoint> next_wakeup() const override;
  [[nodiscard]] bool can_rest() const override { return true; }
  void skip_to(TimePoint now) override;

  /// Taxels of a frame.
  [[nodiscard]] std::size_t taxels() const { return resampler_ ? resampler_->taxels() : pad_count; }

 private:
  [[nodiscard]] TimePoint frame_start(std::uint64_t frame) const;
  void act(TimePoint at, ByteSink& out) override;
  void apply_faults(protocols::taxel::Frame& frame, TimePoint at);
  void apply_pad_faults(protocols::taxel::Frame& frame, TimePoint at);
  void apply_number_faults(TimePoint at);

  TaxelEmulatorParams params_;
  std::optional<PadResampler> resampler_;
  BenchPlant* bench_plant_;
  std::uint64_t next_frame_;
  std::uint16_t sequence_ = 0;

  // Effects of faults.
  std::optional<std::uint16_t> dead_counts_;
  std::optional<protocols::taxel::Frame> frozen_;
};

}  // namespace weft::sim
