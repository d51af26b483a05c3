#include "daemon/hardware/plugins/plugin_driver.hpp"

#include <algorithm>
#include <utility>

#include "drivers/api/driver_base.hpp"
#include "drivers/api/plugin_convert.hpp"

namespace weft::daemon {

/// The functions that the plugin can call.
weft_host_v1 host_table(PluginDriver& driver);

template <class Call>
void PluginDriver::enter(const char* function, const Call& call) {
  const PluginCall inside{device_name_.c_str(), plugin_.file.c_str(), function};
  const char* const outer = std::exchange(function_, function);
  bool late = false;
  ++depth_;
  {
    const PluginWatch::Turn turn(*watch_, &inside);
    try {
      call();
    } catch (const std::exception& e) {
      record_exception(e.what());
    } catch (...) {
      record_exception("an exception of another type than std::exception");
    }
    late = turn.late();
  }
  if (late) record_late();
  --depth_;
  function_ = outer;
  if (depth_ == 0 && broken_) break_off();
}

template <class Call>
Status PluginDriver::call_plugin(const char* function, const Call& call) {
  if (broken_) return pass(*broken_);
  refused_.reset();
  std::int32_t code = 0;
  enter(function, [&] { code = call(); });
  if (broken_) return pass(*broken_);
  if (code == 0) return {};
  if (refused_) return pass(*std::exchange(refused_, {}));
  return fail({.code = Errc::driver, .what = std::string(function) + " refused without a reason"});
}

PluginDriver::PluginDriver(LoadedPlugin plugin, const std::string& device, DriverHost& host,
                           PluginWatch& watch)
    : plugin_(std::move(plugin)),
      host_(&host),
      watch_(&watch),
      device_name_(device),
      table_(host_table(*this)) {
  open_port(link_, &host.link());
  open_port(http_, host.http());
  table_.link = &link_->table;
  table_.http = http_ ? &http_->table : nullptr;
}

Result<std::unique_ptr<Driver>> PluginDriver::create(const LoadedPlugin& plugin,
                                                     const std::string& device,
                                                     std::string_view config_json, DriverHost& host,
                                                     PluginWatch& watch) {
  std::unique_ptr<PluginDriver> made(new PluginDriver(plugin, device, host, watch));
  const std::string config(config_json);
  const Status ok = made->call_plugin("create", [&] {
    made->device_ = plugin.table->create(config.c_str(), &made->table_);
    return made->device_ == nullptr ? WEFT_DEVICE : 0;
  });
  if (!ok) return pass(ok.error());
  return std::unique_ptr<Driver>(std::move(made));
}

PluginDriver::~PluginDriver() {
  broken_off_ = true;  // report no further fault: the host is about to be destroyed
  if (device_ != nullptr) enter("destroy", [&] { plugin_.table->destroy(device_); });
  let_go();
}

Status PluginDriver::open() {
  return call_plugin("open", [&] { return plugin_.table->open(device_); });
}

Status PluginDriver::arm() {
  return call_plugin("arm", [&] { return plugin_.table->arm(device_); });
}

Result<std::uint32_t> PluginDriver::command(const Command& command) {
  const weft_command_v1 order = plugin::c_command(command);
  std::uint32_t move_id = 0;
  const Status ok =
      call_plugin("command", [&] { return plugin_.table->command(device_, &order, &move_id); });
  if (!ok) return pass(ok.error());
  return move_id;
}

void PluginDriver::stop() {
  if (!broken_) enter("stop", [&] { plugin_.table->stop(device_); });
}

void PluginDriver::close() {
  if (!broken_) enter("close", [&] { plugin_.table->close(device_); });
}

void PluginDriver::record_exception(const std::string& what) {
  record_error({.code = Errc::driver,
                .what = "driver code (" + plugin_.file + ") threw an exception in " + function_,
                .expected = "no exception",
                .got = what,
                .hint = "Report the fault to the author of the driver"});
}

void PluginDriver::record_late() {
  record_error({.code = Errc::driver,
                .what = "driver code (" + plugin_.file + ") blocked the program in " + function_,
                .expected = "less than " + std::to_string(watch_->limits().late.count()) + " ms",
                .got = "longer",
                .hint = "Ask the author of the driver to use timers instead of waiting"});
}

void PluginDriver::record_error(Error error) {
  if (!broken_) broken_ = std::move(error);
  if (depth_ == 0) break_off();
}

// Only the first fault counts. stop() is the driver's last chance to end its motions and streams.
void PluginDriver::break_off() {
  if (std::exchange(broken_off_, true) || device_ == nullptr) return;
  enter("stop", [&] { plugin_.table->stop(device_); });
  let_go();
  if (state_ == DriverState::faulted) return;  // the driver itself has reported it
  state_ = DriverState::faulted;
  host_->state_changed(state_);
  host_->fault(*broken_);
}

void PluginDriver::let_go() {
  for (const auto& [own, id] : timers_) host_->loop().cancel(id);
  timers_.clear();
  for (Port* port : {link_.get(), http_.get()}) {
    if (port == nullptr) continue;
    if (std::exchange(port->received, nullptr) != nullptr) port->link->on_receive({});
    if (std::exchange(port->closed, nullptr) != nullptr) port->link->on_closed({});
  }
}

// A link as the plugin calls it.
struct LinkTable {
  using Port = PluginDriver::Port;
  static Port& of(void* self) { return *static_cast<Port*>(self); }

  static std::int32_t write(void* self, const std::uint8_t* bytes, std::size_t size) noexcept {
    Port& port = of(self);
    const PluginWatch::Turn own(*port.driver->watch_, nullptr);
    const Status written = port.link->write({bytes, size});
    if (written) return 0;
    port.error = written.error();
    port.error_c = plugin::c_error(port.error);
    return port.error_c.code;
  }
  static const weft_error_v1* last_error(void* self) noexcept { return &of(self).error_c; }
  static void on_receive(void* self, weft_received_v1 received, void* context) noexcept {
    Port& port = of(self);
    port.received = port.driver->broken_off_ ? nullptr : received;
    port.received_context = context;
    if (port.received == nullptr) return port.link->on_receive({});
    port.link->on_receive([&port](ByteView bytes, TimePoint arrival) {
      port.driver->enter("received", [&] {
        port.received(port.received_context, bytes.data(), bytes.size(), ns_of(arrival));
      });
    });
  }
  static void on_closed(void* self, weft_closed_v1 closed, void* context) noexcept {
    Port& port = of(self);
    port.closed = port.driver->broken_off_ ? nullptr : closed;
    port.closed_context = context;
    if (port.closed == nullptr) return port.link->on_closed({});
    port.link->on_closed([&port](const Error& why) {
      const weft_error_v1 c = plugin::c_error(why);
      port.driver->enter("closed", [&] { port.closed(port.closed_context, &c); });
    });
  }
};

void PluginDriver::open_port(std::unique_ptr<Port>& port, Link* link) {
  if (link == nullptr) return;
  port = std::make_unique<Port>();
  port->driver = this;
  port->link = link;
  port->table = {.struct_size = sizeof(weft_link_v1),
                 .unused = 0,
                 .self = port.get(),
                 .write = &LinkTable::write,
                 .last_error = &LinkTable::last_error,
                 .on_receive = &LinkTable::on_receive,
                 .on_closed = &LinkTable::on_closed};
}

// The functions that the plugin can call. The watch does not count the time spent here.
struct HostTable {
  static PluginDriver& of(void* self) { return *static_cast<PluginDriver*>(self); }
  static PluginWatch::Turn own_turn(PluginDriver& driver) {
    return PluginWatch::Turn(*driver.watch_, nullptr);
  }

  static std::int64_t now_ns(void* self) noexcept { return ns_of(of(self).host_->loop().now()); }
  static std::uint64_t timer_at(void* self, std::int64_t when_ns, weft_timer_v1 run,
                                void* context) noexcept {
    PluginDriver& driver = of(self);
    const std::uint64_t own = ++driver.last_timer_;
    if (driver.broken_off_ || run == nullptr) return own;
    driver.timers_[own] =
        driver.host_->loop().at(plugin::time_of(when_ns), [&driver, own, run, context] {
          driver.timers_.erase(own);
          driver.enter("a timer", [&] { run(context); });
        });
    return own;
  }
  static void timer_cancel(void* self, std::uint64_t id) noexcept {
    PluginDriver& driver = of(self);
    const auto timer = driver.timers_.extract(id);
    if (!timer.empty()) driver.host_->loop().cancel(timer.mapped());
  }

  static void publish(void* self, const weft_sample_v1* sample) noexcept {
    PluginDriver& driver = of(self);
    if (driver.broken_) return;
    const auto turn = own_turn(driver);
    const Result<Sample> made = plugin::sample_of(*sample);
    if (made) return driver.host_->publish(*made);
    Error error = made.error();
    error.what += " (" + driver.plugin_.file + ")";
    driver.record_error(std::move(error));
  }
  static void identified(void* self, const weft_identity_v1* identity) noexcept {
    const auto turn = own_turn(of(self));
    of(self).host_->identified(plugin::identity_of(*identity));
  }
  static void state_changed(void* self, std::uint32_t state) noexcept {
    PluginDriver& driver = of(self);
    if (driver.broken_off_) return;
    driver.state_ = state <= WEFT_FAULTED ? static_cast<DriverState>(state) : DriverState::faulted;
    const auto turn = own_turn(driver);
    driver.host_->state_changed(driver.state_);
  }
  static void fault(void* self, const weft_error_v1* error) noexcept {
    if (of(self).broken_off_) return;
    const auto turn = own_turn(of(self));
    of(self).host_->fault(plugin::error_of(*error));
  }
  static void log(void* self, std::uint32_t level, const char* text) noexcept {
    const auto turn = own_turn(of(self));
    of(self).host_->log(level <= WEFT_LOG_ERROR ? static_cast<LogLevel>(level) : LogLevel::error,
                        text);
  }
  static void refuse(void* self, const weft_error_v1* error) noexcept {
    of(self).refused_ = plugin::error_of(*error);
  }
  static void threw(void* self, const char* what) noexcept { of(self).record_exception(what); }
};

weft_host_v1 host_table(PluginDriver& driver) {
  return {.struct_size = sizeof(weft_host_v1),
          .abi_version = WEFT_DRIVER_ABI_VERSION,
          .self = &driver,
          .link = nullptr,
          .http = nullptr,
          .now_ns = &HostTable::now_ns,
          .timer_at = &HostTable::timer_at,
          .timer_cancel = &HostTable::timer_cancel,
          .publish = &HostTable::publish,
          .identified = &HostTable::identified,
          .state_changed = &HostTable::state_changed,
          .fault = &HostTable::fault,
          .log = &HostTable::log,
          .refuse = &HostTable::refuse,
          .threw = &HostTable::threw};
}

PluginWatch::PluginWatch(Limits limits, Hung hung)
    : limits_(limits), hung_(std::move(hung)), thread_([this] { watch(); }) {}

PluginWatch::~PluginWatch() {
  {
    const std::lock_guard lock(guard_);
    ending_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

// Counts ticks instead of reading a clock: suspending the computer does not make a plugin late.
void PluginWatch::watch() {
  const auto tick = std::max(limits_.late / 8, std::chrono::milliseconds(1));
  std::unique_lock lock(guard_);
  while (!wake_.wait_for(lock, tick, [this] { return ending_; })) {
    if (turn_ == nullptr || turn_->call_ == nullptr) continue;
    const auto before = turn_->lasted_;
    turn_->lasted_ += tick;
    if (before < limits_.hung && turn_->lasted_ >= limits_.hung) hung_(*turn_->call_);
  }
}

PluginWatch::Turn::Turn(PluginWatch& watch, const PluginCall* call) : watch_(&watch), call_(call) {
  const std::lock_guard lock(watch_->guard_);
  outer_ = std::exchange(watch_->turn_, this);
}

PluginWatch::Turn::~Turn() {
  const std::lock_guard lock(watch_->guard_);
  watch_->turn_ = outer_;
}

bool PluginWatch::Turn::late() const {
  const std::lock_guard lock(watch_->guard_);
  return lasted_ >= watch_->limits_.late;
}

}  // namespace weft::daemon
