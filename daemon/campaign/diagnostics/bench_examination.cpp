#include "daemon/campaign/diagnostics/bench_examination.hpp"

#include <algorithm>

namespace weft::daemon {
namespace {

using namespace std::chrono_literals;

// Longer than the drivers' own time limits, which give more precise errors.
constexpr Duration max_wait = 6s;
constexpr Duration poll_period = 50ms;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

bool is_stage(const BenchExamination::Patient& patient) {
  return patient.report->configured_rate_hz == 0 && patient.report->role != "vibro";
}

}  // namespace

BenchExamination::BenchExamination(Loop& loop, LetPass let_pass, std::vector<Patient> patients)
    : loop_(&loop),
      let_pass_(std::move(let_pass)),
      patients_(std::move(patients)),
      streams_(patients_.size()) {}

bool BenchExamination::await(const std::function<bool()>& done, Duration limit) {
  bool over = false;
  const TimerId timer = loop_->after(limit, [&over] { over = true; });
  let_pass_([&] { return over || done(); });
  loop_->cancel(timer);
  return done();
}

/// Calls every device without an error and waits until each has reached `state` or has failed.
void BenchExamination::reach(DriverState state, Status (Driver::*call)()) {
  std::vector<std::size_t> requested;
  for (std::size_t i = 0; i < patients_.size(); ++i) {
    if (patients_[i].report->error) continue;
    const Status ok = (patients_[i].device->driver().*call)();
    if (ok)
      requested.push_back(i);
    else
      patients_[i].report->error = ok.error();
  }
  const auto settled = [&](std::size_t i) {
    Device& device = *patients_[i].device;
    return device.driver().state() == state || device.fault_seen().has_value();
  };
  await([&] { return std::ranges::all_of(requested, settled); }, max_wait);
  for (const std::size_t i : requested) {
    DeviceReport& report = *patients_[i].report;
    if (const auto& fault = patients_[i].device->fault_seen()) report.error = *fault;
    if (!settled(i))
      report.error = Error{.code = Errc::timeout,
                           .where = report.name,
                           .what = "driver does not respond within 6 s",
                           .expected = state == DriverState::open ? "state open" : "state armed",
                           .got = "no response",
                           .hint = "Check power and cable of the device"};
  }
}

void BenchExamination::record_sample(std::size_t i, const Sample& sample) {
  if (!listening_) return;
  Stream& stream = streams_[i];
  DeviceReport& report = *patients_[i].report;
  ++report.samples;
  if (stream.first) report.lost += sample.lost;
  if (stream.last)
    report.longest_gap_s = std::max(report.longest_gap_s, to_seconds(sample.host - *stream.last));
  if (!stream.first) stream.first = sample.host;
  stream.last = sample.host;
  if (const auto requested = std::exchange(stream.requested, std::nullopt))
    stream.latencies_s.push_back(to_seconds(sample.host - *requested));
}

void BenchExamination::poll_stages() {
  for (std::size_t i = 0; i < patients_.size(); ++i) {
    const Patient& patient = patients_[i];
    if (patient.report->error || !is_stage(patient) || streams_[i].requested) continue;
    streams_[i].requested = loop_->now();
    if (!patient.device->driver().command(PollCommand{})) streams_[i].requested.reset();
  }
  poll_timer_ = loop_->after(poll_period, [this] { poll_stages(); });
}

void BenchExamination::listen(double duration_s) {
  for (std::size_t i = 0; i < patients_.size(); ++i)
    patients_[i].device->on_sample([this, i](const Sample& sample) { record_sample(i, sample); });
  listening_ = true;
  poll_stages();
  await([] { return false; }, from_seconds(duration_s));
  listening_ = false;
  loop_->cancel(poll_timer_);
}

void BenchExamination::conclude(std::size_t i) {
  const Patient& patient = patients_[i];
  DeviceReport& report = *patient.report;
  const Stream& stream = streams_[i];
  report.identity = patient.device->identity();
  if (const auto& fault = patient.device->fault_seen(); fault && !report.error)
    report.error = *fault;
  if (stream.first && stream.last > stream.first)
    report.rate_hz =
        static_cast<double>(report.samples - 1) / to_seconds(*stream.last - *stream.first);
  if (!stream.latencies_s.empty()) {
    report.latency_s = median(stream.latencies_s);
    report.worst_latency_s = std::ranges::max(stream.latencies_s);
  }
}

void BenchExamination::run(double listen_s) {
  const auto note = [this](DriverState state, bool DeviceReport::*flag) {
    for (const Patient& patient : patients_)
      patient.report->*flag = patient.device->driver().state() == state;
  };
  reach(DriverState::open, &Driver::open);
  note(DriverState::open, &DeviceReport::answered);
  reach(DriverState::armed, &Driver::arm);
  note(DriverState::armed, &DeviceReport::armed);
  listen(listen_s);
  for (std::size_t i = 0; i < patients_.size(); ++i) conclude(i);
  for (const Patient& patient : patients_) {
    patient.device->on_sample({});
    patient.device->driver().stop();
    patient.device->driver().close();
  }
}

}  // namespace weft::daemon
