#include "daemon/service/methods/services.hpp"
#include "daemon/service/rpc/session.hpp"

namespace weft::daemon::api {

void add_methods(rpc::Methods& methods, const Services& services) {
  server::add_session_open(methods);
  server::add_cancel(methods);
  add_session_methods(methods, services);
  add_system_methods(methods, services);
  add_lease_methods(methods, services);
  add_recipe_methods(methods, services);
  add_recipe_put(methods, services);
  add_run_methods(methods, services);
  add_queue_methods(methods, services);
  add_rig_methods(methods, services);
  add_rig_description(methods, services);
  add_device_methods(methods, services);
  add_classify_methods(methods, services);
  add_data_methods(methods, services);
  add_plan_methods(methods, services);
  add_handover_methods(methods, services);
  add_sim_methods(methods, services);
  add_subscription_methods(methods, services);
  add_token_methods(methods, services);
}

}  // namespace weft::daemon::api
