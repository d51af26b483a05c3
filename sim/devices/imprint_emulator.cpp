#include "sim/devices/imprint_emulator.hpp"

#include <algorithm>
#include <cmath>

namespace weft::sim {

namespace imprint = protocols::imprint;

namespace {

constexpr double same_force = 1e-3;  // of the force; the same share of full scale is 1/8 count
constexpr double least_force_n = 1e-3;
/// Tolerance of the pressures: a hundredth of the resolution, one of 127 counts.
constexpr double press_tolerance = 1e-4 / imprint::highest_count;
constexpr std::uint8_t side = array_side;
constexpr imprint::Window whole_array{0, 0, side, side};
static_assert(array_side == imprint::max_side);
/// The bare plate: on a rig with this array every object has a face (Rig::create).
constexpr ObjectSpec bare{.name = "bare plate"};

const ObjectSpec& object_on_plate(const std::string& name) {
  const ObjectSpec* object = find_object(name);
  return object != nullptr ? *object : bare;
}

}  // namespace

Status PressedFace::lay(const ObjectSpec& object, std::uint64_t seed) {
  auto map = place(object, array_side, array_side, taxel_spacing_m, seed);
  if (!map) return pass(map.error());
  map_ = std::move(*map);
  pressed_n_ = -1;
  bed_ = bed_under(object);
  const double modulus_pa = modulus_under(object);
  if (level_ != Level::z_plus || (half_space_ && modulus_pa_ == modulus_pa)) return {};
  auto made = HalfSpace::make(array_side, array_side, taxel_spacing_m,
                              {.modulus_pa = modulus_pa, .tolerance = press_tolerance});
  if (!made) return pass(made.error());
  half_space_ = std::move(*made);
  modulus_pa_ = modulus_pa;
  return {};
}

Result<const Imprint*> PressedFace::press(double force_n) {
  if (pressed_n_ >= 0 && std::abs(force_n - pressed_n_) <= same_force * pressed_n_)
    return &imprint_;
  auto pressed =
      half_space_ ? half_space_->press(map_, force_n) : press_winkler(map_, bed_, force_n);
  if (!pressed) return pass(pressed.error());
  imprint_ = std::move(*pressed);
  pressed_n_ = force_n;
  return &imprint_;
}

ImprintEmulator::ImprintEmulator(const ImprintEmulatorParams& params, BenchPlant& bench_plant,
                                 TimePoint now)
    : FrameEmulator(now, params.largest_chunk_bytes, mix(params.seed, "pieces")),
      params_(params),
      bench_plant_(&bench_plant),
      next_description_(now),
      next_scan_(now + Duration(params.period_ns)),
      window_(whole_array),
      face_(params.level),
      seen_mounts_(bench_plant.mounts() - 1) {}

void ImprintEmulator::receive(ByteView bytes, TimePoint now, ByteSink& out) {
  wake(now, out);
  requests_.push(bytes);
  while (requests_.next(request_)) {
    if (request_.kind != imprint::Kind::request || request_.window == window_) continue;
    window_ = request_.window;
    cover_ = {};
  }
}

std::optional<TimePoint> ImprintEmulator::next_wakeup() const {
  return std::min(next_description_, next_scan_);
}

void ImprintEmulator::act(TimePoint at, ByteSink& out) {
  apply_number_faults(at);
  if (next_description_ == at) send_description(at, out);
  if (next_scan_ == at) send_scan(at, out);
}

void ImprintEmulator::send_description(TimePoint at, ByteSink& out) {
  next_description_ += description_period;
  if (active_fault(FaultKind::silent, at) != nullptr) return;
  imprint::Frame frame;
  frame.sequence = descriptions_++;
  frame.device_us = clock_us(at, at);
  frame.description = {
      .serial = params_.serial,
      .firmware = params_.firmware,
      .rows = side,
      .cols = side,
      .bits = static_cast<std::uint8_t>(params_.taxels.bits),
      .spacing_um = static_cast<std::uint16_t>(std::lround(taxel_spacing_m * 1e6)),
      .full_scale_pa = static_cast<std::uint32_t>(std::lround(params_.taxels.full_scale_pa)),
      .period_us = static_cast<std::uint32_t>(params_.period_ns / 1000)};
  send(frame, at, out);
}

/// Images the object on the plate after a change.
Status ImprintEmulator::image_plate() {
  if (seen_mounts_ == bench_plant_->mounts()) return {};
  cover_ = {};
  const Patch& patch = bench_plant_->patch();
  if (Status laid = face_.lay(object_on_plate(patch.fabric), patch.seed); !laid) return laid;
  seen_mounts_ = bench_plant_->mounts();
  return {};
}

/// The taxels of the window under the present force, all read at once [E].
Result<TaxelFrame> ImprintEmulator::read(TimePoint at) {
  if (Status laid = image_plate(); !laid) return pass(laid.error());
  const double force_n = bench_plant_->contact(at).normal_n;
  Imprint part{window_.rows, window_.cols, std::vector<double>(window_.taxels()), 0, 0};
  if (force_n >= least_force_n) {
    const auto whole = face_.press(force_n);
    if (!whole) return pass(whole.error());
    auto cut =
        extract_part(**whole, window_.first_row, window_.first_col, window_.rows, window_.cols);
    if (!cut) return pass(cut.error());
    part = std::move(*cut);
  }
  return read_taxels(params_.taxels, part, cover_, mix(mix(params_.seed, "noise"), scans_));
}

/// A scan without a solution of its press is not sent: the host sees a gap.
void ImprintEmulator::send_scan(TimePoint at, ByteSink& out) {
  next_scan_ += Duration(params_.period_ns);
  const std::uint64_t number = scans_++;
  const auto taxels = read(at);
  if (withheld(number, at)) return;
  imprint::Frame frame;
  frame.kind = imprint::Kind::scan;
  frame.sequence = sequence_++;
  if (!taxels) return;
  frame.device_us = clock_us(at, at);
  frame.window = window_;
  std::ranges::transform(taxels->counts, frame.counts.begin(), [](std::uint16_t counts) {
    return static_cast<std::uint8_t>(std::min<std::uint16_t>(counts, imprint::highest_count));
  });
  apply_faults(frame, at);
  send(frame, at, out);
}

void ImprintEmulator::apply_number_faults(TimePoint at) {
  sequence_ = static_cast<std::uint16_t>(sequence_ + number_jump(at));
  if (!restarts(at)) return;
  sequence_ = 0;
  next_description_ = at;
  window_ = whole_array;
  cover_ = {};
}

void ImprintEmulator::apply_faults(imprint::Frame& frame, TimePoint at) {
  if (frozen(FaultKind::frozen_frame, at, frame, frozen_) && frozen_->window == frame.window)
    frame.counts = frozen_->counts;
  if (const Fault* wrong = active_fault(FaultKind::wrong_count, at))
    frame.window = {0, 0, 1,
                    static_cast<std::uint8_t>(std::clamp(wrong->amount, 1.0, double{side}))};
}

}  // namespace weft::sim
