!> The mesh of a run: the given mesh, or the coarsest of several meshes whose motion agrees with that of the next finer
!> mesh within a tolerance (docs/theory.md, section 15). The module also makes the beam on this mesh and caches it
!> for further cases with the same beam. The grading of a mesh is the ratio of its longest to its shortest element.
module mesh_choice
   use applied_loads, only: courses_of
   use beam_model, only: beam_model_t
   use beam_section, only: area, section_t
   use failures, only: failure_t
   use free_modes, only: free_modes_t
   use kinds, only: wp
   use load_settings, only: last_change
   use mesh_checks, only: mesh_check_t
   use mesh_comparison, only: compare_meshes
   use mode_trials, only: is_driven, solution_work, trial_settings
   use motion_run, only: find_shared_modes, run_motion
   use response_types, only: response_t
   use run_differences, only: horizon_of
   use run_settings, only: method_exact, run_settings_t, strict_mode_tolerance
   use scene_beam_model, only: model_of, redistributes, run_settings_of, section_of
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: case_beam_t, make_case_beam, choose_mesh, update_case_beam, coarsest_near_minimum, max_elements_found
   public :: search_mesh, trial_t, run_on_mesh, run_trial, work_of, cheap_work

   !> Numbers of elements of the meshes that are tried, one after the other.
   integer, parameter :: meshes(*) = [4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192]
   !> Maximum number of elements of a mesh that the search finds.
   integer, parameter :: max_elements_found = meshes(size(meshes))
   !> The coarser of two meshes is chosen if the difference of their runs is at most this fraction of the tolerance. An
   !> error of fourth order is 1.25 times the difference from a mesh with 1.5 times as many elements, so the error is
   !> then about half the tolerance.
   real(wp), parameter :: agreement = 0.4_wp
   !> The search ends after this number of successive meshes without progress, because the motion is then chaotic. The
   !> value only determines how soon a search that does not converge ends.
   integer, parameter :: max_stalled = 4
   !> A mesh makes progress if its difference is below this fraction of the smallest previous difference.
   real(wp), parameter :: required_reduction = 0.7_wp
   !> If there are contacts, a mesh that agrees with the next finer mesh is also compared with the mesh this number of
   !> places further on: two coarse meshes on which a light body is hit once can agree, although it is hit several
   !> times.
   integer, parameter :: confirming = 3
   !> Number of elements of the mesh on which a uniform and a graded mesh are compared.
   integer, parameter :: graded_elements = 8
   !> Maximum grading for a taper with a thin tip, a value suitable for a full wedge. The exact value is not critical,
   !> because a graded mesh is chosen only if it differs less from the next finer mesh.
   real(wp), parameter :: max_grading = 4.0_wp
   !> Relative tolerance of the mesh of a scene that gives none.
   real(wp), parameter :: default_tolerance = 1.0e-3_wp
   !> Index in `meshes` of the coarsest mesh that a search without a request of the scene chooses if no mesh is within
   !> the tolerance.
   integer, parameter :: min_place = 3
   !> Work that takes about 0.1 s. Work is the number of terms of modal sums instead of a time, so that the mesh of a
   !> scene does not depend on the speed and load of the machine.
   real(wp), parameter :: cheap_work = 2.0e6_wp
   !> Maximum work of a search that the scene does not request: this multiple of the work of the run, or of `cheap_work`
   !> if that is larger.
   real(wp), parameter :: max_work_ratio = 3.0_wp

   !> The beam of a case, and the modes that its runs share.
   type :: case_beam_t
      type(beam_model_t) :: model
      type(free_modes_t) :: modes
      !> Result of the search for the mesh, if the mesh was found
      type(mesh_check_t) :: check
      !> Set if the beam could not be made
      type(failure_t), allocatable :: error
      !> Values of the parameters for which the beam was made; unallocated: there is no beam yet
      real(wp), allocatable :: values(:)
   end type case_beam_t

   !> The run on one of the meshes that are compared.
   type :: trial_t
      !> Number of elements of the mesh
      integer :: elements = 0
      type(case_beam_t) :: beam
      type(response_t) :: response
      !> Set if the run failed
      type(failure_t), allocatable :: error
   end type trial_t

contains

   !> Make the beam of a scene on a mesh.
   subroutine make_case_beam(scene, elements, ratio, beam, settings)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: elements
      !> Length of an element over that of the next towards the tip
      real(wp), intent(in) :: ratio
      type(case_beam_t), intent(out) :: beam
      !> Settings of the runs if they differ from those of the scene
      type(run_settings_t), intent(in), optional :: settings

      call model_of(scene, elements, ratio, beam%model, beam%error, moves=.true.)
      if (allocated(beam%error)) return
      if (present(settings)) then
         call find_shared_modes(beam%model, settings, beam%modes, beam%error)
      else
         call find_shared_modes(beam%model, run_settings_of(scene), beam%modes, beam%error)
      end if
   end subroutine make_case_beam

   !> Make the beam of a case on its mesh, unless the beam of the preceding case is the same.
   subroutine update_case_beam(scene, values, changes_beam, beam, extremes)
      !> The scene with the values of the case
      type(scene_t), intent(in) :: scene
      !> Values of the parameters that differ from case to case, in the same order for all cases
      real(wp), intent(in) :: values(:)
      !> Whether a change of each parameter changes the beam
      logical, intent(in) :: changes_beam(:)
      type(case_beam_t), intent(inout) :: beam
      !> Cases with the minimum and with the maximum values of all parameters that do not change the beam, [2]: the mesh
      !> found for both is used for all cases of this beam, independent of their order. Absent: the mesh is given
      type(scene_t), intent(in), optional :: extremes(:)

      ! allocated, because the type is large and stacks of threads are small
      type(case_beam_t), allocatable :: other
      logical :: is_cached

      is_cached = allocated(beam%values)
      if (is_cached) is_cached = all(abs(values - beam%values) <= 0.0_wp .or. .not. changes_beam)
      if (.not. is_cached) then
         if (present(extremes)) then
            allocate (other)
            call choose_mesh(extremes(1), beam)
            call choose_mesh(extremes(2), other)
            if (.not. allocated(other%error) .and. other%check%elements > beam%check%elements) beam = other
         else
            call choose_mesh(scene, beam)
         end if
         beam%values = values
      end if
      call update_mass(scene, beam)
   end subroutine update_case_beam

   !> Replace the beam if its mass matrix is not that for the stops of this case: with automatic choice, the mass matrix
   !> depends on the stop.
   subroutine update_mass(scene, beam)
      type(scene_t), intent(in) :: scene
      type(case_beam_t), intent(inout) :: beam

      type(case_beam_t), allocatable :: other

      if (allocated(beam%error)) return
      if (beam%model%is_redistributed .eqv. redistributes(scene, beam%model%mesh)) return
      allocate (other)
      if (beam%check%finer_elements > 0) then
         call make_case_beam(scene, beam%check%elements, beam%check%ratio, other)
      else
         call make_case_beam(scene, scene%mesh%elements, scene%mesh%ratio, other)
      end if
      other%check = beam%check
      other%check%is_redistributed = other%model%is_redistributed
      other%values = beam%values
      beam = other
   end subroutine update_mass

   !> Make the beam of a scene on the given mesh, or on the mesh found within the tolerance of the scene.
   subroutine choose_mesh(scene, beam)
      type(scene_t), intent(in) :: scene
      type(case_beam_t), intent(out) :: beam

      if (scene%mesh%tolerance > 0.0_wp) then
         call search_mesh(scene, 1.0_wp, beam)
      else
         call make_case_beam(scene, scene%mesh%elements, scene%mesh%ratio, beam)
         beam%check = scene%mesh%found
         beam%check%is_redistributed = beam%model%is_redistributed
      end if
   end subroutine choose_mesh

   !> Find the mesh of a scene within its tolerance, or within `default_tolerance` if the scene gives no mesh, and make
   !> its beam.
   subroutine search_mesh(scene, work_fraction, beam)
      type(scene_t), intent(in) :: scene
      !> Fraction of the work that the search of a scene without a mesh may take
      real(wp), intent(in) :: work_fraction
      type(case_beam_t), intent(out) :: beam

      type(case_beam_t), allocatable :: first
      type(run_settings_t) :: settings

      settings = run_settings_of(scene)
      settings%response%method = method_exact
      ! differences of meshes must not include errors of modal truncation
      settings%response%mode_tolerance = min(settings%response%mode_tolerance, strict_mode_tolerance)
      allocate (first)
      call make_case_beam(scene, meshes(1), 1.0_wp, first, settings)
      if (allocated(first%error)) then
         beam = first
         return
      end if
      settings = trial_settings(settings, first%modes%lambda(1))
      settings%output%measures = .true.
      call refine_mesh(scene, settings, work_fraction, beam)
      ! Newmark's method does not use the modes
      if (scene%response%method /= method_exact) beam%modes = free_modes_t()
   end subroutine search_mesh

   !> Refine the mesh until the motion converges within the tolerance. The elements have equal lengths; for a beam that
   !> is thinner at the tip, from `graded_elements` on they have lengths proportional to the local wavelength, if this
   !> graded mesh differs less from the next finer mesh than the uniform mesh does. Stops, supports and masses force
   !> nodes, so that meshes of different requested numbers can have almost the same nodes: meshes are compared if the
   !> finer one has at least 5/4 of the elements of the other.
   subroutine refine_mesh(scene, settings, work_fraction, beam)
      type(scene_t), intent(in) :: scene
      !> Settings of the runs that are compared; those of a search that the scene does not request become shorter
      type(run_settings_t), intent(inout) :: settings
      !> Fraction of the work that the search of a scene without a mesh may take
      real(wp), intent(in) :: work_fraction
      type(case_beam_t), intent(out) :: beam

      ! ratio of the duration of further runs to the horizon of the first run, up to which it could be compared
      real(wp), parameter :: reserve = 1.25_wp
      type(trial_t), allocatable :: coarse, fine, other
      type(mesh_check_t) :: check(size(meshes)), of_other
      real(wp) :: grading, max_work, minimum, other_grading, tolerance, work
      integer :: i, last, stalled

      allocate (coarse, fine, other)
      call gradings_of(scene, grading, other_grading)
      tolerance = merge(default_tolerance, scene%mesh%tolerance, scene%mesh%is_sought)
      minimum = huge(1.0_wp)
      stalled = 0
      call run_on_mesh(scene, settings, meshes(1), grading, coarse)
      work = work_of(coarse%response, settings)
      call await_motion(run_settings_of(scene), settings, coarse, work)
      max_work = huge(1.0_wp)
      if (scene%mesh%is_sought) then
         max_work = work_fraction*max(cheap_work, max_work_ratio*work_of_run(coarse, settings, run_settings_of(scene)))
         if (.not. allocated(coarse%error)) settings%response%duration = min(settings%response%duration, &
            reserve*horizon_of(coarse%response, settings%response%duration))
      end if
      i = 1
      last = 1
      do while (i < size(meshes))
         call run_on_mesh(scene, settings, meshes(i + 1), grading, fine)
         work = work + work_of(fine%response, settings)
         check(i) = mesh_check_t(elements=coarse%elements, finer_elements=fine%elements, tolerance=tolerance, &
            ratio=ratio_of(grading, coarse%elements), is_redistributed=coarse%beam%model%is_redistributed, &
            is_relative=scene%mesh%is_sought, difference=huge(1.0_wp))
         if (4*fine%beam%model%mesh%elements < 5*coarse%beam%model%mesh%elements) then
            coarse = fine
            i = i + 1
            cycle
         end if
         call compare(settings%response%duration, agreement, coarse, fine, check(i))
         of_other = check(i)
         if (check(i)%is_converged .and. coarse%response%event_count > 0 .and. i + confirming <= size(meshes)) then
            call run_on_mesh(scene, settings, meshes(i + confirming), grading, other)
            work = work + work_of(other%response, settings)
            call compare(settings%response%duration, 1.0_wp, coarse, other, of_other)
            if (.not. of_other%is_converged) check(i) = of_other
         end if
         if (check(i)%is_converged) then
            beam = coarse%beam
            beam%check = check(i)
            return
         end if
         if (coarse%elements == graded_elements .and. other_grading > grading) then
            call run_on_mesh(scene, settings, graded_elements, other_grading, other)
            call compare(settings%response%duration, agreement, other, fine, of_other)
            if (of_other%difference < check(i)%difference) then
               grading = other_grading
               coarse = other
               ! the graded mesh is now compared with a finer graded mesh
               cycle
            end if
         end if
         stalled = merge(0, stalled + 1, check(i)%difference < required_reduction*minimum)
         minimum = min(minimum, check(i)%difference)
         last = i
         ! the next mesh takes about twice the work of this mesh
         check(i)%is_cut = work + 2.0_wp*work_of(fine%response, settings) > max_work
         if (stalled == max_stalled .or. is_costly(fine) .or. check(i)%is_cut) exit
         coarse = fine
         i = i + 1
      end do
      i = coarsest_near_minimum(check(:last)%difference)
      if (scene%mesh%is_sought) i = max(i, min(min_place, last))
      check(i)%is_cut = check(last)%is_cut
      call make_case_beam(scene, meshes(i), check(i)%ratio, beam)
      beam%check = check(i)
   end subroutine refine_mesh

   !> If the beam touches nothing in the first of the runs that are compared, lengthen the runs: they then end as long
   !> after the first contact as they ended after the start or, if no contact occurs in the whole run, after the last
   !> onset of a load.
   subroutine await_motion(requested, settings, first, work)
      !> Settings of the run
      type(run_settings_t), intent(in) :: requested
      !> Settings of the runs that are compared
      type(run_settings_t), intent(inout) :: settings
      !> The first of these runs
      type(trial_t), intent(inout) :: first
      !> Work so far
      real(wp), intent(inout) :: work

      ! a longer run has at most this number of samples
      integer, parameter :: max_samples = 4096
      ! ratio of the duration of a run to that of the run before, as long as the beam touches nothing
      real(wp), parameter :: growth = 4.0_wp
      real(wp) :: end, length, onset

      associate (response => settings%response)
         length = response%duration
         end = length
         onset = last_change(courses_of(requested), requested%response%duration)
         do while (end < requested%response%duration .and. requested%has_stop)
            if (allocated(first%error) .or. first%response%event_count > 0) exit
            end = min(requested%response%duration, growth*end)
            call run_again(end)
         end do
         if (allocated(first%error)) then
            if (end > length) call run_again(length)
            return
         end if
         if (first%response%event_count > 0) onset = merge(first%response%events(1)%tau, 0.0_wp, end > length)
         end = min(requested%response%duration, onset + length)
         if (abs(end - response%duration) > 0.0_wp) call run_again(end)
      end associate

   contains

      !> Repeat the run with another duration.
      subroutine run_again(duration)
         real(wp), intent(in) :: duration

         settings%response%duration = duration
         settings%response%step = max(settings%response%step, duration/real(max_samples, wp))
         first%response = response_t()
         if (allocated(first%error)) deallocate (first%error)
         call run_trial(settings, first)
         work = work + work_of(first%response, settings)
      end subroutine run_again

   end subroutine await_motion

   !> The mesh if no mesh is within the tolerance: the coarsest mesh whose difference is at most twice the minimum
   !> difference.
   pure integer function coarsest_near_minimum(difference) result(place)
      !> Difference of each mesh from the next finer mesh, > 0
      real(wp), intent(in) :: difference(:)

      place = findloc(0.5_wp*difference <= minval(difference), .true., 1)
   end function coarsest_near_minimum

   !> Whether the run on a finer mesh would take seconds, because this run has evaluated more than `max_terms` terms of
   !> modes. Without damping, the number of impacts grows without limit as the mesh is refined.
   pure logical function is_costly(trial) result(answer)
      type(trial_t), intent(in) :: trial

      real(wp), parameter :: max_terms = 1.0e7_wp

      answer = real(trial%response%evaluations, wp)*real(2*trial%elements, wp) > max_terms
   end function is_costly

   !> Work of a run: terms of modal sums in evaluations and recorded samples, and the solution for all modes.
   pure real(wp) function work_of(response, settings, modes) result(work)
      type(response_t), intent(in) :: response
      type(run_settings_t), intent(in) :: settings
      !> Number of modes in the run; absent: all modes of the mesh
      integer, intent(in), optional :: modes

      real(wp) :: samples
      integer :: all_modes, terms

      samples = 0.0_wp
      if (any(settings%output%history)) samples = settings%response%duration/settings%response%step
      all_modes = 2*response%mesh_check%elements
      terms = all_modes
      if (present(modes)) terms = modes
      work = real(terms, wp)*(real(response%evaluations, wp) + samples) + solution_work*real(all_modes, wp)**3
   end function work_of

   !> Estimated minimum work of the run of a scene on the mesh of a trial: the work of the trial; for a driven run, in
   !> proportion to the duration.
   pure real(wp) function work_of_run(trial, settings, requested) result(work)
      type(trial_t), intent(in) :: trial
      !> Settings of the trial
      type(run_settings_t), intent(in) :: settings
      !> Settings of the run
      type(run_settings_t), intent(in) :: requested

      work = work_of(trial%response, settings)
      if (is_driven(requested)) work = work*max(1.0_wp, requested%response%duration/settings%response%duration)
   end function work_of_run

   !> Run a scene on a mesh, for the interval in which meshes are compared.
   subroutine run_on_mesh(scene, settings, elements, grading, trial)
      type(scene_t), intent(in) :: scene
      type(run_settings_t), intent(in) :: settings
      integer, intent(in) :: elements
      !> Grading of the mesh, the ratio of its longest to its shortest element
      real(wp), intent(in) :: grading
      type(trial_t), intent(out) :: trial

      trial%elements = elements
      call make_case_beam(scene, elements, ratio_of(grading, elements), trial%beam, settings)
      call run_trial(settings, trial)
   end subroutine run_on_mesh

   !> Run a trial whose beam has been made.
   subroutine run_trial(settings, trial)
      type(run_settings_t), intent(in) :: settings
      type(trial_t), intent(inout) :: trial

      if (allocated(trial%beam%error)) then
         allocate (trial%error, source=trial%beam%error)
         return
      end if
      call run_motion(trial%beam%model, settings, trial%response, trial%error, trial%beam%modes)
   end subroutine run_trial

   !> Ratio of neighbouring element lengths of a mesh with a given grading.
   elemental real(wp) function ratio_of(grading, elements) result(ratio)
      !> Grading, the ratio of the longest to the shortest element
      real(wp), intent(in) :: grading
      integer, intent(in) :: elements

      ! one element has no neighbour
      ratio = grading**(1.0_wp/real(max(1, elements - 1), wp))
   end function ratio_of

   !> Compare the runs on two meshes.
   pure subroutine compare(duration, fraction, coarse, fine, check)
      !> Duration of both runs, tau
      real(wp), intent(in) :: duration
      !> The meshes agree if the difference is at most this fraction of the tolerance
      real(wp), intent(in) :: fraction
      type(trial_t), intent(in) :: coarse
      type(trial_t), intent(in) :: fine
      !> Check of the coarse mesh; the finer mesh and the result of the comparison are set
      type(mesh_check_t), intent(inout) :: check

      check%finer_elements = fine%elements
      check%difference = huge(1.0_wp)
      check%is_converged = .false.
      if (allocated(coarse%error) .or. allocated(fine%error)) return
      call compare_meshes(coarse%response, fine%response, duration, fraction, check)
   end subroutine compare

   !> Gradings of the meshes that are compared: the grading of the scene's mesh, and for a beam that is thinner at the
   !> tip the grading that follows the local wavelength.
   pure subroutine gradings_of(scene, grading, other)
      type(scene_t), intent(in) :: scene
      real(wp), intent(out) :: grading
      !> Second grading; equal to `grading` if there is only one grading
      real(wp), intent(out) :: other

      type(section_t) :: section
      real(wp) :: thickest, thinnest

      ! the length ratio in the scene is taken as that of a mesh with `graded_elements` elements
      grading = scene%mesh%ratio**(graded_elements - 1)
      other = grading
      if (abs(scene%mesh%ratio - 1.0_wp) > 0.0_wp) return
      section = section_of(scene%beam)
      ! sections are functions of the distance to the tip: 1 at the root, and the middle of the element at the tip
      thickest = area(section, 1.0_wp)
      thinnest = area(section, 0.5_wp/real(graded_elements, wp))
      ! the wavelength of bending waves varies as the square root of the height; a slight taper needs no grading
      if (thinnest < 0.7_wp*thickest) other = min(max_grading, sqrt(thickest/thinnest))
   end subroutine gradings_of

end module mesh_choice
