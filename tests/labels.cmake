# SPDX-License-Identifier: MIT
# The labels of tests, by which tools/test.sh chooses them: the kind (unit, shader, pipeline, training or python); the
# step that runs the test (unit, sync, gpu, long or python; sync is under Vulkan's validation, gpu is not); and
# `sanitized` for what runs under ASan and UBSan, too. The last part of a name says how long it takes: _slow or _long.

cmake_policy(PUSH)
cmake_policy(VERSION 3.22)  # ctest, which includes this, sets none

# Without validation run tests of processes and scripts, tests that look at SPIR-V or at other vector widths, and tests
# of passes that other tests record with other numbers.
set(darb_without_validation "_slow$|PassSpirv|^scripts\\.|^pages\\.|\\.Outputs$")
set(darb_same_passes kernel_gradient_test walk_test accuracy_walk_test hard_case_test blend_test blend_backward_test
  project_test effect_picture_test viewer_picture_test)
# Not under sanitizers run numerical tests of the device, which use no other host code, and tests that read no files.
set(darb_not_sanitized "_slow$|PassSpirv|\\.Reference/|^scripts\\.|^pages\\.|\\.(Outputs|StrategyTable|ClusterRows|Undistort|Psi)$")
# The same tests as cases of GoogleTest, where each case is a process.
set(darb_not_sanitized_cases *_slow *_slow/* *_long *_long/* *PassSpirv* Outputs.* every*/* settings/* Reference/*
  *WalkCases* *TuningWalk* Psi.* *HardCases* *EffectPicture* *EffectTraining* *for_every_kernel *Accuracy_switch_changes*)

function(darb_labels out test kind)
  set(labels ${kind})
  if(test MATCHES "_long$")
    list(APPEND labels long)
  elseif(NOT kind MATCHES "^(unit|python)$")
    if(kind STREQUAL training OR test MATCHES "${darb_without_validation}" OR test IN_LIST darb_same_passes)
      list(APPEND labels gpu)
    else()
      list(APPEND labels sync)
    endif()
  endif()
  if(kind MATCHES "^(unit|pipeline)$" AND NOT test MATCHES "${darb_not_sanitized}|_long$|^trained_command_test$")
    list(APPEND labels sanitized)
  endif()
  set(${out} "${labels}" PARENT_SCOPE)
endfunction()

cmake_policy(POP)
