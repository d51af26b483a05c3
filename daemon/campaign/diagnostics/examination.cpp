#include "daemon/campaign/diagnostics/examination.hpp"

#include <algorithm>

namespace weft::daemon {
namespace {

using namespace std::chrono_literals;

// Drivers have time limits of their own, which say more than this one.
constexpr Duration patience = 6s;
constexpr Duration ask_period = 50ms;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

bool is_stage(const Examination::Patient& patient) {
  return patient.report->configured_rate_hz == 0 && patient.report->role != "vibro";
}

}  // namespace

Examination::Examination(Loop& loop, LetPass let_pass, std::vector<Patient> patients)
    : loop_(&loop),
      let_pass_(std::move(let_pass)),
      patients_(std::move(patients)),
      streams_(patients_.size()) {}

bool Examination::await(const std::function<bool()>& done, Duration limit) {
  bool over = false;
  const TimerId timer = loop_->after(limit, [&over] { over = true; });
  let_pass_([&] { return over || done(); });
  loop_->cancel(timer);
  return done();
}

/// Asks every device that is well, and waits until each is there or has failed.
void Examination::reach(DriverState state, Status (Driver::*call)()) {
  std::vector<std::size_t> asked;
  for (std::size_t i = 0; i < patients_.size(); ++i) {
    if (patients_[i].report->error) continue;
    const Status ok = (patients_[i].device->driver().*call)();
    if (ok)
      asked.push_back(i);
    else
      patients_[i].report->error = ok.error();
  }
  const auto settled = [&](std::size_t i) {
    Device& device = *patients_[i].device;
    return device.driver().state() == state || device.fault_seen().has_value();
  };
  await([&] { return std::ranges::all_of(asked, settled); }, patience);
  for (const std::size_t i : asked) {
    DeviceReport& report = *patients_[i].report;
    if (const auto& fault = patients_[i].device->fault_seen()) report.error = *fault;
    if (!settled(i))
      report.error = Error{.code = Errc::timeout,
                           .where = report.name,
                           .what = "the driver says nothing within 6 s",
                           .expected = std::string(state == DriverState::open ? "open" : "armed"),
                           .got = "silence"};
  }
}

void Examination::heard(std::size_t i, const Sample& sample) {
  if (!listening_) return;
  Stream& stream = streams_[i];
  DeviceReport& report = *patients_[i].report;
  ++report.samples;
  if (stream.first) report.lost += sample.lost;
  if (stream.last)
    report.longest_gap_s = std::max(report.longest_gap_s, to_seconds(sample.host - *stream.last));
  if (!stream.first) stream.first = sample.host;
  stream.last = sample.host;
  if (const auto asked = std::exchange(stream.asked, std::nullopt))
    stream.latencies_s.push_back(to_seconds(sample.host - *asked));
}

void Examination::ask_stages() {
  for (std::size_t i = 0; i < patients_.size(); ++i) {
    const Patient& patient = patients_[i];
    if (patient.report->error || !is_stage(patient) || streams_[i].asked) continue;
    streams_[i].asked = loop_->now();
    if (!patient.device->driver().command(PollCommand{})) streams_[i].asked.reset();
  }
  ask_timer_ = loop_->after(ask_period, [this] { ask_stages(); });
}

void Examination::listen(double duration_s) {
  for (std::size_t i = 0; i < patients_.size(); ++i)
    patients_[i].device->on_sample([this, i](const Sample& sample) { heard(i, sample); });
  listening_ = true;
  ask_stages();
  await([] { return false; }, from_seconds(duration_s));
  listening_ = false;
  loop_->cancel(ask_timer_);
}

void Examination::conclude(std::size_t i) {
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

void Examination::run(double listen_s) {
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
