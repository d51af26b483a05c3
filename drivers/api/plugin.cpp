#include "drivers/api/plugin.hpp"

#include <map>
#include <optional>
#include <utility>

#include "drivers/api/plugin_convert.hpp"

namespace weft::plugin {
namespace {

/// Runs the driver's code. Catches its exceptions and reports them to the host.
template <class Code>
void contain(const weft_host_v1& host, const Code& code) noexcept {
  try {
    code();
  } catch (const std::exception& e) {
    host.threw(host.self, e.what());
  } catch (...) {
    host.threw(host.self, "an exception that is not a std::exception");
  }
}

class HostLoop final : public Loop {
 public:
  explicit HostLoop(const weft_host_v1& host) : host_(&host) {}
  ~HostLoop() override {
    for (const auto& [id, timer] : timers_) host_->timer_cancel(host_->self, id);
  }
  HostLoop(const HostLoop&) = delete;
  HostLoop& operator=(const HostLoop&) = delete;

  [[nodiscard]] TimePoint now() const override { return time_of(host_->now_ns(host_->self)); }
  TimerId at(TimePoint when, Callback callback) override {
    auto timer = std::make_unique<OneTimer>(OneTimer{this, 0, std::move(callback)});
    timer->id = host_->timer_at(host_->self, ns_of(when), &run, timer.get());
    const TimerId id = timer->id;
    timers_.emplace(id, std::move(timer));
    return id;
  }
  void cancel(TimerId id) override {
    if (timers_.erase(id) != 0) host_->timer_cancel(host_->self, id);
  }

 private:
  struct OneTimer {
    HostLoop* loop;
    TimerId id;
    Callback callback;
  };
  static void run(void* context) {
    auto* timer = static_cast<OneTimer*>(context);
    HostLoop& loop = *timer->loop;
    const auto taken = loop.timers_.extract(timer->id);
    contain(*loop.host_, [&] { taken.mapped()->callback(); });
  }

  const weft_host_v1* host_;
  std::map<TimerId, std::unique_ptr<OneTimer>> timers_;
};

class HostLink final : public Link {
 public:
  HostLink(const weft_host_v1& host, const weft_link_v1& link) : host_(&host), link_(&link) {}
  ~HostLink() override {
    link_->on_receive(link_->self, nullptr, nullptr);
    link_->on_closed(link_->self, nullptr, nullptr);
  }
  HostLink(const HostLink&) = delete;
  HostLink& operator=(const HostLink&) = delete;

  Status write(ByteView bytes) override {
    if (link_->write(link_->self, bytes.data(), bytes.size()) == 0) return {};
    return pass(error_of(*link_->last_error(link_->self)));
  }
  void on_receive(Receiver receiver) override {
    receiver_ = std::move(receiver);
    link_->on_receive(link_->self, receiver_ ? &received : nullptr, this);
  }
  void on_closed(Closed closed) override {
    closed_ = std::move(closed);
    link_->on_closed(link_->self, closed_ ? &gone : nullptr, this);
  }

 private:
  // The callback may replace itself, so a copy runs.
  static void received(void* context, const std::uint8_t* bytes, std::size_t size,
                       std::int64_t arrival_ns) {
    const auto* link = static_cast<HostLink*>(context);
    contain(*link->host_, [&] {
      const Receiver receiver = link->receiver_;
      if (receiver) receiver({bytes, size}, time_of(arrival_ns));
    });
  }
  static void gone(void* context, const weft_error_v1* why) {
    const auto* link = static_cast<HostLink*>(context);
    contain(*link->host_, [&] {
      const Closed closed = link->closed_;
      if (closed) closed(error_of(*why));
    });
  }

  const weft_host_v1* host_;
  const weft_link_v1* link_;
  Receiver receiver_;
  Closed closed_;
};

class Host final : public DriverHost {
 public:
  explicit Host(const weft_host_v1& host) : host_(&host), loop_(host), link_(host, *host.link) {
    if (host.http != nullptr) http_.emplace(host, *host.http);
  }

  Loop& loop() override { return loop_; }
  Link& link() override { return link_; }
  Link* http() override { return http_ ? &*http_ : nullptr; }
  void publish(const Sample& sample) override {
    with_c_sample(sample, [this](const weft_sample_v1& c) { host_->publish(host_->self, &c); });
  }
  void identified(const DeviceIdentity& identity) override {
    with_c_identity(identity,
                    [this](const weft_identity_v1& c) { host_->identified(host_->self, &c); });
  }
  void state_changed(DriverState state) override {
    host_->state_changed(host_->self, static_cast<std::uint32_t>(state));
  }
  void fault(const Error& error) override {
    const weft_error_v1 c = c_error(error);
    host_->fault(host_->self, &c);
  }
  void log(LogLevel level, std::string_view text) override {
    host_->log(host_->self, static_cast<std::uint32_t>(level), std::string(text).c_str());
  }
  /// Reports `error` to the host. Returns the result code of the C function.
  std::int32_t refuse(const Error& error) {
    const weft_error_v1 c = c_error(error);
    host_->refuse(host_->self, &c);
    return c.code;
  }
  [[nodiscard]] const weft_host_v1& table() const { return *host_; }

 private:
  const weft_host_v1* host_;
  HostLoop loop_;
  HostLink link_;
  std::optional<HostLink> http_;
};

}  // namespace
}  // namespace weft::plugin

/// The driver is the last member: it uses the host until it is destroyed.
struct weft_device {
  explicit weft_device(const weft_host_v1& table) : host(table) {}
  weft::plugin::Host host;
  std::unique_ptr<weft::Driver> driver;
};

namespace weft::plugin {
namespace {

/// Runs `code`, which returns a Status. Returns the result code of the C function.
template <class Code>
std::int32_t outcome(weft_device* device, const Code& code) noexcept {
  std::int32_t result = WEFT_DEVICE;  // result after an exception
  contain(device->host.table(), [&] {
    const Status done = code(*device->driver);
    result = done ? 0 : device->host.refuse(done.error());
  });
  return result;
}

std::int32_t command(weft_device* device, const weft_command_v1* order, std::uint32_t* move_id) {
  return outcome(device, [&](Driver& driver) -> Status {
    const Result<Command> wanted = command_of(*order);
    if (!wanted) return pass(wanted.error());
    const Result<std::uint32_t> id = driver.command(*wanted);
    if (!id) return pass(id.error());
    *move_id = *id;
    return {};
  });
}

}  // namespace

weft_device* create(const DriverEntry& entry, const char* config_json, const weft_host_v1* host) {
  weft_device* made = nullptr;
  contain(*host, [&] {
    auto device = std::make_unique<weft_device>(*host);
    Result<std::unique_ptr<Driver>> driver = entry.create(config_json, device->host);
    if (!driver) {
      device->host.refuse(driver.error());
      return;
    }
    device->driver = std::move(*driver);
    made = device.release();
  });
  return made;
}

weft_driver_entry_v1 table(const DriverEntry& entry) {
  weft_driver_entry_v1 made{};
  made.abi_version = WEFT_DRIVER_ABI_VERSION;
  made.struct_size = sizeof(made);
  made.build_fingerprint = WEFT_DRIVER_FINGERPRINT;
  made.name = entry.name;
  made.summary = entry.summary;
  made.config_schema_json = entry.config_schema_json;
  made.destroy = [](weft_device* device) {
    const weft_host_v1 host = device->host.table();
    contain(host, [&] { delete device; });
  };
  made.open = [](weft_device* device) {
    return outcome(device, [](Driver& driver) { return driver.open(); });
  };
  made.arm = [](weft_device* device) {
    return outcome(device, [](Driver& driver) { return driver.arm(); });
  };
  made.command = &command;
  made.stop = [](weft_device* device) {
    contain(device->host.table(), [&] { device->driver->stop(); });
  };
  made.close = [](weft_device* device) {
    contain(device->host.table(), [&] { device->driver->close(); });
  };
  return made;
}

}  // namespace weft::plugin
