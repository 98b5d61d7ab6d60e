// SPDX-License-Identifier: MIT
// darb.Trainer: `darb train` step by step, with the same options and the same bits.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "tools/python/dataset.h"
#include "tools/python/device.h"
#include "trainer/job/job.h"
#include "trainer/step/trainer.h"

namespace darb::python {

class PyTrainer {
  public:
    /// dataset: a PyDataset or a path. options: named as on the command line.
    PyTrainer(std::shared_ptr<PyDevice> device, const py::object& dataset, const py::dict& options);
    ~PyTrainer();
    PyTrainer(const PyTrainer&) = delete;
    PyTrainer& operator=(const PyTrainer&) = delete;

    /// Runs n iterations, or fewer where the run ends; returns what the last one reports.
    py::dict step(const py::object& n, const py::object& loss);
    py::dict evaluate();
    SplatModel model();
    void checkpoint(const py::object& path);

    const TrainRequest& request() const { return job_.request; }
    int iteration() const { return trainer_->iteration(); }
    int iterations() const { return job_.options.iterations; }
    std::uint32_t splats() const { return trainer_->splat_count(); }
    py::object on_round = py::none();

  private:
    void make_trainer();
    void tell_round(int iteration, const DensityResult& result);
    const std::string& fingerprint();

    std::shared_ptr<PyDevice> device_;
    TrainJob job_;
    std::vector<ImageU8> photos_;
    std::string fingerprint_;
    std::unique_ptr<Trainer> trainer_;
    IterationResult latest_;
    double seconds_ = 0;
};

void bind_trainer(py::module_& module);

}  // namespace darb::python
