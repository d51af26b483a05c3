#include "daemon/hardware/rig/bench.hpp"

#include <algorithm>

#include "protocols/base/bytes.hpp"

namespace weft::daemon {
namespace {

using namespace std::chrono_literals;

constexpr Duration poll_period = 10ms;
constexpr Duration ready_limit = 5s;
// Limit for a driver that reports nothing at all. The driver knows the limit of its own stage and
// reports the cause. Longer than any home_timeout_s that a driver accepts.
constexpr Duration home_limit = 4000s;
constexpr std::array home_order{StageAxis::z, StageAxis::rx, StageAxis::ry, StageAxis::x,
                                StageAxis::y};

std::optional<StageAxis> axis_of_role(std::string_view role) {
  for (const StageAxis axis : recipes::all_axes)
    if (recipes::to_string(axis) == role) return axis;
  return std::nullopt;
}

constexpr std::array<std::string_view, 5> sample_names{"stage", "wrench", "taxel", "acceleration",
                                                       "sound"};
static_assert(std::variant_size_v<decltype(Sample::value)> == sample_names.size());

/// A rig file may give a device any role; only here its driver's samples are compared with the
/// role.
void refuse(Device& device, const Sample& sample) {
  device.fault(Error{.code = Errc::invalid_argument,
                     .what = "samples do not fit the role of the device",
                     .expected = "samples for role " + device.entry().role,
                     .got = std::string(sample_names[sample.value.index()]) +
                            " samples of driver " + device.entry().driver,
                     .hint = "Check role and driver of this device in the rig file"});
}

std::uint32_t digest_of_counts(const TaxelSample& sample) {
  std::uint32_t digest = 0;
  std::array<std::uint8_t, 32> bytes{};  // crc32() processes eight bytes per step
  for (auto left = sample.counts; !left.empty();) {
    const auto some = left.first(std::min(left.size(), bytes.size() / 2));
    left = left.subspan(some.size());
    for (std::size_t i = 0; i < some.size(); ++i) {
      bytes[2 * i] = static_cast<std::uint8_t>(some[i] & 0xFF);
      bytes[2 * i + 1] = static_cast<std::uint8_t>(some[i] >> 8);
    }
    digest = crc32(ByteView(bytes).first(2 * some.size()), digest);
  }
  return digest;
}

}  // namespace

recipes::Joints Snapshot::joints() const {
  recipes::Joints joints;
  for (std::size_t i = 0; i < stage.size(); ++i) joints.value[i] = stage[i].position;
  return joints;
}

Result<std::unique_ptr<Bench>> Bench::create(const RigFile& rig, Loop& loop,
                                             const LinkFactory& links, const LinkFactory& pages) {
  std::unique_ptr<Bench> bench(new Bench(loop));
  bench->hold(rig.fixed);
  for (const DeviceEntry& entry : rig.devices) {
    Result<std::unique_ptr<Link>> link = links(entry);
    if (!link) return pass(link.error(), entry.name);
    Result<std::unique_ptr<Link>> http = std::unique_ptr<Link>{};
    if (entry.http && pages) http = pages(entry);
    if (!http) return pass(http.error(), entry.name);
    Result<std::unique_ptr<Device>> device =
        Device::create(entry, loop, std::move(*link), rig.drivers, std::move(*http));
    if (!device) return pass(device.error());
    bench->devices_.push_back(std::move(*device));
    bench->connect(*bench->devices_.back());
  }
  return bench;
}

void Bench::hold(const FixedAxes& fixed) {
  for (std::size_t i = 0; i < fixed.size(); ++i) {
    if (!fixed[i]) continue;
    snapshot_.fixed[i] = true;
    snapshot_.stage[i].position = *fixed[i];
    snapshot_.stage[i].homed = true;
  }
}

Bench::~Bench() {
  loop_->cancel(poll_timer_);
  for (const auto& device : devices_) device->driver().close();
}

void Bench::connect(Device& device) {
  const std::string& role = device.entry().role;
  if (const std::optional<StageAxis> axis = axis_of_role(role)) {
    const std::size_t i = recipes::index(*axis);
    stages_[i] = &device;
    device.on_sample([this, &device, i](const Sample& sample) {
      const auto* const reading = std::get_if<StageSample>(&sample.value);
      if (reading == nullptr) return refuse(device, sample);
      snapshot_.stage[i] = *reading;
      snapshot_.stage_at[i] = sample.host;
    });
  } else if (role == "wrench") {
    wrench_ = &device;
    device.on_sample([this](const Sample& sample) { on_wrench(sample); });
  } else if (role == "taxels") {
    const std::size_t array = taxels_.add_array();
    snapshot_.taxels.emplace_back();
    device.on_sample(
        [this, &device, array](const Sample& sample) { on_taxels(device, array, sample); });
  } else {
    device.on_sample([this, &device](const Sample& sample) {
      if (!std::holds_alternative<AccelerationSample>(sample.value) &&
          !std::holds_alternative<SoundSample>(sample.value))
        return refuse(device, sample);
      if (sensor_sink_) sensor_sink_(device, sample);
    });
  }
}

void Bench::on_wrench(Sample sample) {
  auto* const wrench = std::get_if<WrenchSample>(&sample.value);
  if (wrench == nullptr) return refuse(*wrench_, sample);
  for (std::size_t i = 0; i < 3; ++i) {
    wrench->force_n[i] -= zero_.force_n[i];
    wrench->torque_nm[i] -= zero_.torque_nm[i];
  }
  snapshot_.wrench = *wrench;
  snapshot_.wrench_at = sample.host;
  snapshot_.wrench_recent.add(*wrench);
  if (sensor_sink_) sensor_sink_(*wrench_, sample);
}

void Bench::on_taxels(Device& device, std::size_t array, const Sample& sample) {
  const auto* const frame = std::get_if<TaxelSample>(&sample.value);
  if (frame == nullptr) return refuse(device, sample);
  snapshot_.taxels[array] = {digest_of_counts(*frame), sample.host};
  taxels_.take(array, *frame);
  if (!taxels_.is_complete()) return;
  if (wrench_ == nullptr) touch_.add(taxels_.counts());
  if (array == 0 && sensor_sink_) sensor_sink_(device, taxels_.joined(sample));
}

const Error* Bench::fault() const {
  for (const auto& device : devices_)
    if (device->fault_seen()) return &*device->fault_seen();
  return host_fault_ ? &*host_fault_ : nullptr;
}

void Bench::on_log(const Device::LogSink& sink) {
  for (const auto& device : devices_) device->on_log(sink);
}

void Bench::finish(Status outcome) {
  loop_->cancel(poll_timer_);
  if (const auto done = std::exchange(done_, {})) done(std::move(outcome));
}

void Bench::await(std::function<bool()> ready, Duration limit, std::string what,
                  std::function<void()> then) {
  ready_ = std::move(ready);
  then_ = std::move(then);
  awaited_ = std::move(what);
  deadline_ = loop_->now() + limit;
  poll();
}

void Bench::poll() {
  if (const Error* error = fault()) return finish(pass(*error));
  if (ready_()) return std::exchange(then_, {})();
  if (loop_->now() >= deadline_)
    return finish(
        fail({.code = Errc::timeout, .where = "bench", .what = awaited_ + " not reached in time"}));
  poll_timer_ = loop_->after(poll_period, [this] { poll(); });
}

void Bench::bring_up(std::function<void(Status)> done, Homing homing) {
  done_ = std::move(done);
  const auto all_in = [this](DriverState state) {
    return std::all_of(devices_.begin(), devices_.end(),
                       [&](const auto& d) { return d->driver().state() == state; });
  };
  for (const auto& device : devices_)
    if (Status ok = device->driver().open(); !ok)
      return finish(pass(ok.error(), device->entry().name));
  await([all_in] { return all_in(DriverState::open); }, ready_limit, "state open",
        [this, all_in, homing] {
          for (const auto& device : devices_)
            if (Status ok = device->driver().arm(); !ok)
              return finish(pass(ok.error(), device->entry().name));
          await([all_in] { return all_in(DriverState::armed); }, ready_limit, "state armed",
                [this, homing] { homing == Homing::all ? home(0) : read_all(); });
        });
}

void Bench::home(std::size_t position) {
  while (position < home_order.size() && !has_stage(home_order[position])) ++position;
  if (position == home_order.size()) return read_all();
  const std::size_t i = recipes::index(home_order[position]);
  const Result<std::uint32_t> id = stages_[i]->driver().command(HomeCommand{});
  if (!id) return finish(pass(id.error(), stages_[i]->entry().name));
  await(
      [this, i, id = *id] { return snapshot_.stage[i].move_id == id && snapshot_.stage[i].homed; },
      home_limit, "home of " + stages_[i]->entry().name, [this, position] { home(position + 1); });
}

// The stages that were homed first have been silent since then: the next steps start from fresh
// readings.
void Bench::read_all() {
  const TimePoint requested = loop_->now();
  for (Device* stage : stages_) {
    if (stage == nullptr) continue;
    if (const auto sent = stage->driver().command(PollCommand{}); !sent)
      return finish(pass(sent.error(), stage->entry().name));
  }
  const auto fresh = [this, requested] {
    for (std::size_t i = 0; i < stages_.size(); ++i)
      if (const auto& at = snapshot_.stage_at[i]; stages_[i] && !(at && *at > requested))
        return false;
    return true;
  };
  await(fresh, ready_limit, "new readings of all stages", [this] { finish({}); });
}

}  // namespace weft::daemon
