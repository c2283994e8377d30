// kmax._kmax: the library for Python, as thin as it can be; kmax/__init__.py makes it convenient.
//
// Nothing here holds the interpreter's lock (the GIL) while it waits for a device. Python's own signal
// handlers, Ctrl-C's first of all, run at least every 50 ms in the main thread while it waits.

#include <kmax/kmax.hpp>

#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

namespace py = pybind11;

namespace {
using Released = py::call_guard<py::gil_scoped_release>;

/// Lets Python answer to signals, with an exception if it wants to.
void check_signals() {
  const py::gil_scoped_acquire lock;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

/// A device whose end does not hold the lock either.
class PythonDevice {
 public:
  explicit PythonDevice(const std::string& address)
      : device_(std::make_unique<kmax::Device>(
            address, kmax::DeviceOptions{.poll = check_signals, .notice = notice})) {}
  ~PythonDevice() {
    const py::gil_scoped_release released;
    device_.reset();
  }
  PythonDevice(const PythonDevice&) = delete;
  PythonDevice& operator=(const PythonDevice&) = delete;

  kmax::Device& operator*() { return *device_; }
  kmax::Device* operator->() { return device_.get(); }

 private:
  /// A warning, as Python has them, unless Python is about to end.
  static void notice(const std::string& text) {
    if (!Py_IsInitialized()) return;
    const py::gil_scoped_acquire lock;
    if (PyErr_WarnEx(PyExc_RuntimeWarning, text.c_str(), 1) != 0) PyErr_WriteUnraisable(nullptr);
  }

  std::unique_ptr<kmax::Device> device_;
};

/// A vector of records as a structured array, which owns it.
template <typename Record>
py::array array_of(std::vector<Record>&& records) {
  auto* owned = new std::vector<Record>(std::move(records));
  const py::capsule owner(owned, [](void* memory) { delete static_cast<std::vector<Record>*>(memory); });
  return py::array_t<Record>(static_cast<py::ssize_t>(owned->size()), owned->data(), owner);
}

py::object python_value(const kmax::Value& value) {
  if (!value.choice.empty()) return py::str(value.choice);
  if (value.whole) return py::int_(static_cast<long long>(value.number));
  return py::float_(value.number);
}

kmax::CaptureRequest capture_request(std::vector<std::string> channels, std::size_t axis,
                                     const std::string& trigger, double level, std::uint32_t samples,
                                     std::uint32_t pre_trigger, std::uint32_t interval, double patience) {
  return {.channels = std::move(channels),
          .axis = axis,
          .trigger = trigger,
          .level = level,
          .samples = samples,
          .pre_trigger = pre_trigger,
          .interval = interval,
          .patience = patience};
}

py::tuple capture(PythonDevice& device, const kmax::CaptureRequest& request, const py::object& armed) {
  kmax::Capture captured;
  {
    const py::gil_scoped_release released;
    captured = device->capture(request, [&armed] {
      const py::gil_scoped_acquire lock;
      if (!armed.is_none()) armed();
    });
  }
  py::dict values, units;
  for (const kmax::CapturedChannel& channel : captured.channels) {
    values[py::str(channel.name)] =
        py::array_t<double>(static_cast<py::ssize_t>(channel.values.size()), channel.values.data());
    units[py::str(channel.name)] = channel.unit;
  }
  return py::make_tuple(
      py::array_t<double>(static_cast<py::ssize_t>(captured.time.size()), captured.time.data()), values,
      units);
}

py::tuple record(PythonDevice& device, double seconds, std::size_t axis, const py::object& more) {
  kmax::Recording recording;
  {
    const py::gil_scoped_release released;
    std::function<bool(const std::vector<kmax::Sample>&)> hand_over;
    if (more.ptr() != Py_None)
      hand_over = [&more](const std::vector<kmax::Sample>& block) {
        const py::gil_scoped_acquire lock;
        const py::object answer = more(array_of(std::vector<kmax::Sample>(block)));
        return answer.is_none() || answer.cast<bool>();
      };
    recording = device->record(seconds, axis, hand_over);
  }
  return py::make_tuple(array_of(std::move(recording.samples)), recording.lost, recording.source);
}

py::tuple force_loop(PythonDevice& device, const py::object& function, std::optional<double> seconds,
                     std::optional<double> rate, double watchdog, std::size_t axis, std::size_t keep) {
  kmax::ForceRecord record;
  {
    const py::gil_scoped_release released;
    record = device->force_loop(
        {.axis = axis, .rate = rate, .seconds = seconds, .watchdog = watchdog, .keep = keep},
        [&function](const kmax::Sample& sample) -> std::optional<double> {
          const py::gil_scoped_acquire lock;
          if (PyErr_CheckSignals() != 0) throw py::error_already_set();
          const py::object force = function(sample);
          if (force.is_none()) return std::nullopt;
          const double newtons = PyFloat_AsDouble(force.ptr());
          if (newtons == -1.0 && PyErr_Occurred() != nullptr) throw py::error_already_set();
          return newtons;
        });
  }
  return py::make_tuple(array_of(std::move(record.steps)), record.rate, record.missed);
}

py::dict run_scene(const std::string& scene,
                   const std::vector<std::pair<std::string, std::string>>& parameters) {
  kmax::SceneResult result;
  {
    const py::gil_scoped_release released;
    result = kmax::run_scene(scene, parameters);
  }
  py::list axes;
  for (auto& samples : result.axes) axes.append(array_of(std::move(samples)));
  py::dict all;
  all["name"] = result.name;
  all["axes"] = axes;
  all["state"] = result.state;
  all["fault"] = result.fault;
  all["contact"] = result.contact;
  all["peak_to_peak"] = result.peak_to_peak;
  all["deepest"] = result.deepest;
  return all;
}

void register_errors(py::module_& module) {
  static const py::exception<kmax::Error> error(module, "Error", PyExc_RuntimeError);
  static const py::exception<kmax::LinkError> link_error(module, "LinkError", error);
  static const py::exception<kmax::RefusedError> refused_error(module, "RefusedError", error);
  static const py::exception<kmax::WatchdogError> watchdog_error(module, "WatchdogError", error);
  for (const char* name : {"Error", "LinkError", "RefusedError", "WatchdogError"})
    module.attr(name).attr("__module__") = "kmax";
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const kmax::ValueError& what) {
      PyErr_SetString(PyExc_ValueError, what.what());
    } catch (const kmax::Interrupted& what) {
      PyErr_SetString(PyExc_KeyboardInterrupt, what.what());
    } catch (const kmax::LinkError& what) {
      PyErr_SetString(link_error.ptr(), what.what());
    } catch (const kmax::RefusedError& what) {
      PyErr_SetString(refused_error.ptr(), what.what());
    } catch (const kmax::WatchdogError& what) {
      PyErr_SetString(watchdog_error.ptr(), what.what());
    } catch (const kmax::Error& what) {
      PyErr_SetString(error.ptr(), what.what());
    }
  });
}
}  // namespace

PYBIND11_MODULE(_kmax, module) {
  PYBIND11_NUMPY_DTYPE(kmax::Sample, time, position, velocity, force, current, flags);
  PYBIND11_NUMPY_DTYPE(kmax::ForceStep, time, position, velocity, measured_force, force, lateness, round_trip,
                       flags);
  PYBIND11_NUMPY_DTYPE(kmax::SceneSample, time, true_position, true_velocity, hand_position, position,
                       velocity, force, applied_force);
  register_errors(module);
  module.attr("version") = kmax::version();

  py::class_<kmax::Sample>(module, "Sample")
      .def_readonly("time", &kmax::Sample::time)
      .def_readonly("position", &kmax::Sample::position)
      .def_readonly("velocity", &kmax::Sample::velocity)
      .def_readonly("force", &kmax::Sample::force)
      .def_readonly("current", &kmax::Sample::current)
      .def_readonly("flags", &kmax::Sample::flags);

  py::class_<PythonDevice>(module, "Device")
      .def(py::init<const std::string&>(), Released())
      .def(
          "close", [](PythonDevice& device) { device->close(); }, Released())
      .def_property_readonly("is_open", [](PythonDevice& device) { return device->is_open(); })
      .def_property_readonly("address", [](PythonDevice& device) { return device->address(); })
      .def("get",
           [](PythonDevice& device, const std::vector<std::string>& names) {
             std::vector<kmax::Value> values;
             {
               const py::gil_scoped_release released;
               values = device->get(names);
             }
             py::list all;
             for (const kmax::Value& value : values)
               all.append(py::make_tuple(python_value(value), value.unit));
             return all;
           })
      .def(
          "set",
          [](PythonDevice& device, const std::vector<std::pair<std::string, std::string>>& values) {
            device->set(values);
          },
          Released())
      .def("status",
           [](PythonDevice& device, std::size_t axis) {
             kmax::Status status;
             {
               const py::gil_scoped_release released;
               status = device->status(axis);
             }
             return py::make_tuple(status.state, status.armed, status.faulty, status.words);
           })
      .def(
          "arm",
          [](PythonDevice& device, std::size_t axis, bool keep_alive) { device->arm(axis, keep_alive); },
          Released())
      .def(
          "disarm", [](PythonDevice& device, std::size_t axis) { return device->disarm(axis); }, Released())
      .def(
          "stop", [](PythonDevice& device, std::size_t axis) { device->stop(axis); }, Released())
      .def(
          "clear", [](PythonDevice& device, std::size_t axis) { return device->clear(axis); }, Released())
      .def(
          "wait", [](PythonDevice& device, double seconds) { device->wait(seconds); }, Released())
      .def("record", record)
      .def("capture",
           [](PythonDevice& device, std::vector<std::string> channels, std::size_t axis,
              const std::string& trigger, double level, std::uint32_t samples, std::uint32_t pre_trigger,
              std::uint32_t interval, double patience, const py::object& armed) {
             return capture(device,
                            capture_request(std::move(channels), axis, trigger, level, samples, pre_trigger,
                                            interval, patience),
                            armed);
           })
      .def("force_loop", force_loop)
      .def(
          "command",
          [](PythonDevice& device, const std::vector<std::string>& arguments) {
            const kmax::CommandResult result = device->command(arguments);
            return std::make_pair(result.verdict, result.document);
          },
          Released());

  module.def(
      "run_command",
      [](const std::vector<std::string>& arguments) {
        const kmax::CommandResult result = kmax::run_command(arguments);
        return std::make_pair(result.verdict, result.document);
      },
      Released());
  module.def("run_scene", run_scene);
  module.def("scene_names", kmax::scene_names);
}
