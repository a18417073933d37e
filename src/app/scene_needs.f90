!> The memory that a scene of the program `impactbeam` needs, summed from estimates for its beams, modes, histories,
!> tables and sweeps.
module scene_needs
   use few_modes, only: common_count, takes_few_modes
   use frequency_study, only: uses_lanczos
   use history_list, only: acceleration_stop, eta_stop, force_stop, velocity_stop
   use kinds, only: wp
   use load_settings, only: is_in_mode, time_course_t
   use measure_list, only: measure_count
   use measure_selection, only: chosen_measures
   use memory_needs, only: add_modes, add_need, bytes_of_number, memory_need_t, overhead, short_text
   use mesh_choice, only: max_elements_found
   use number_text, only: to_text
   use run_settings, only: method_exact, moves_in_modes, run_settings_t, stops_of
   use scene_beam_model, only: run_settings_of
   use scene_types, only: default_mode_count, scene_t, solver_auto, solver_dsygv, solver_lanczos
   use stop_contacts, only: has_one_contact, contacts_of
   use sweep_plan, only: cases_of_chunk, section_values
   use sweep_settings, only: is_swept, parameter_index, value_count_of, values_given
   use sweep_spectra, only: spectrum_size
   use sweep_study, only: case_count_of, chain_count_of, threads_for
   implicit none (type, external)
   private
   public :: memory_need_of_scene

contains

   !> Estimate the memory that a scene needs.
   subroutine memory_need_of_scene(scene, threads, need)
      type(scene_t), intent(in) :: scene
      !> Number of threads of a sweep; 0: as many as there are cores
      integer, intent(in) :: threads
      type(memory_need_t), intent(out) :: need

      ! number of runs at the same time: threads of a sweep, or all cases
      integer :: workers

      if (scene%wants_sweep) then
         workers = threads_for(threads, chain_count_of(scene%sweep))
         call add_sweep(scene, workers, need)
         call add_tables(scene, workers, need)
         if (scene%wants_uncertainty) call add_need(need, bytes_of_number*case_count_of(scene%sweep)* &
            real(2 + size(chosen_measures(scene, scene%uncertainty%measures)), wp), 'the measures of ' &
            //short_text(case_count_of(scene%sweep))//' cases', 'give &uncertainty fewer measures')
      else
         if (scene%wants_frequencies) call add_frequencies(scene, need)
         if (scene%wants_response) call add_response(scene, need)
         workers = 1
         if (scene%wants_cases) workers = size(scene%cases%list)
         call add_tables(scene, workers, need)
      end if
   end subroutine memory_need_of_scene

   !> Add the tables of loads: as read and echoed, and as converted by each run.
   subroutine add_tables(scene, runs, need)
      type(scene_t), intent(in) :: scene
      !> Number of simultaneous runs
      integer, intent(in) :: runs
      type(memory_need_t), intent(inout) :: need

      ! measured number of reals per point in the scene
      real(wp), parameter :: per_scene = 6.0_wp
      ! measured number of reals per point in each run
      real(wp), parameter :: per_run = 6.0_wp
      real(wp) :: points
      integer :: k

      points = 0.0_wp
      if (allocated(scene%forces)) points = sum([(points_of(scene%forces(k)%course), k=1, size(scene%forces))])
      if (allocated(scene%bases)) points = points + sum([(points_of(scene%bases(k)%course), k=1, size(scene%bases))])
      call add_need(need, bytes_of_number*points*(per_scene + per_run*real(runs, wp)), 'tables of ' &
         //short_text(points)//' points', 'give &force and &base shorter tables')

   contains

      !> Number of points of the table of a load; 0: it has none.
      pure real(wp) function points_of(course) result(number)
         type(time_course_t), intent(in) :: course

         number = 0.0_wp
         if (allocated(course%time)) number = real(size(course%time), wp)
      end function points_of

   end subroutine add_tables

   !> Add the frequencies. Their columns (modes of one mesh by one solver) are computed one after the other, so the
   !> largest counts.
   subroutine add_frequencies(scene, need)
      type(scene_t), intent(in) :: scene
      type(memory_need_t), intent(inout) :: need

      type(memory_need_t) :: column, largest
      integer :: i, j, modes, split_elements

      split_elements = count_split_elements(scene)
      modes = scene%frequencies%count
      if (modes == 0) modes = default_mode_count
      associate (elements => scene%frequencies%mesh_elements, solvers => scene%frequencies%solver)
         do i = 1, size(elements)
            do j = 1, size(solvers)
               column = memory_need_t()
               call add_column(solvers(j), elements(i) + split_elements, modes, scene%has_supports, column)
               if (i == 1 .and. scene%output%mode_shapes > 0) then
                  call add_column(solvers(1), elements(1) + split_elements, scene%output%mode_shapes, .true., column)
               end if
               if (allocated(column%refusal)) then
                  need = column
                  return
               end if
               if (column%bytes > largest%bytes) largest = column
            end do
         end do
      end associate
      if (allocated(largest%purpose)) call add_need(need, largest%bytes - overhead, largest%purpose, largest%advice)
   end subroutine add_frequencies

   !> Add some modes of one mesh by one solver.
   subroutine add_column(solver, elements, max_modes, with_shapes, need)
      !> One of the `solver_` constants
      integer, intent(in) :: solver
      integer, intent(in) :: elements
      !> Number of modes requested
      integer, intent(in) :: max_modes
      !> Whether mode shapes are requested
      logical, intent(in) :: with_shapes
      type(memory_need_t), intent(inout) :: need

      character(*), parameter :: advice = "give &frequencies fewer elements, or solver = 'lanczos' and a small count"
      real(wp) :: n
      integer :: modes
      logical :: by_lanczos

      n = real(elements, wp)
      modes = min(max_modes, 2*elements)
      by_lanczos = solver == solver_lanczos
      if (solver == solver_auto) by_lanczos = uses_lanczos(elements, modes)
      if (by_lanczos) then
         modes = min(modes, elements)
         ! Lanczos vectors, deflections at four points per element, shapes, and the beam itself
         call add_need(need, bytes_of_number*(n*(8.0_wp*real(modes, wp) + 30.0_wp) + 12.5_wp*real(modes, wp)**2), &
            to_text(modes)//' modes of '//to_text(elements)//' elements', 'give a smaller count or fewer elements')
      else if (solver == solver_dsygv) then
         call add_need(need, 3.0_wp*bytes_of_number*(2.0_wp*n)**2, 'the full matrices of '//to_text(elements)// &
            ' elements', advice)
      else if (with_shapes) then
         call add_modes(elements, 1, advice, need)
      else
         call add_need(need, 4.0_wp*bytes_of_number*(2.0_wp*n)**2, 'the flexibility of '//to_text(elements)// &
            ' elements', advice)
      end if
      if (with_shapes) call add_need(need, 6.0_wp*bytes_of_number*n*real(modes, wp), to_text(modes)//' mode shapes', &
         'give &output fewer mode_shapes')
   end subroutine add_column

   !> Add the beam and the records of a response, or of the responses of all cases. Records exist three times: in the
   !> run, in the HDF5 file that is made in memory, and in the bytes that are written.
   subroutine add_response(scene, need)
      type(scene_t), intent(in) :: scene
      type(memory_need_t), intent(inout) :: need

      real(wp), parameter :: copies = 3.0_wp
      real(wp) :: samples, runs
      ! number of instants at which the whole beam is recorded
      real(wp) :: shapes
      ! number of contacts with individual histories
      integer :: contacts
      integer :: histories, numbers
      type(run_settings_t) :: settings

      settings = run_settings_of(scene)
      runs = 1.0_wp
      if (scene%wants_cases) runs = real(max(size(scene%cases%list), 1), wp)
      call add_beam(scene, elements_of(scene, scene%mesh%elements), 1, need)
      associate (output => scene%output)
         histories = count(output%history)
         ! about eight datasets: the terms of the energy balance and a dataset tau of their own
         if (output%energy) histories = histories + 8
         if (scene%wants_stress .and. scene%stress%history) histories = histories + 1 + 2*size(scene%stress%position)
         ! the dataset tau
         if (histories > 0) histories = histories + 1
         contacts = 0
         if (.not. has_one_contact(settings, merge(1, 0, allocated(scene%supports)))) then
            contacts = size(contacts_of(settings))
         end if
         histories = histories + contacts*count(output%history([eta_stop, velocity_stop, force_stop, &
            acceleration_stop]))
         ! for each contact the stored energy and the dissipated energy
         if (output%energy) histories = histories + 2*contacts
         samples = scene%response%duration/scene%response%step
         call add_need(need, copies*runs*bytes_of_number*samples*real(histories, wp), 'the histories of ' &
            //short_text(runs*samples)//' samples', &
            'give &response a longer step, or &output fewer histories')
         shapes = 0.0_wp
         if (allocated(output%shape_times)) shapes = real(size(output%shape_times), wp)
         if (output%shape_step > 0.0_wp) shapes = shapes + scene%response%duration/output%shape_step
         ! each node has a displacement, a slope and their rates
         call add_need(need, copies*runs*bytes_of_number*shapes*4.0_wp*(real(scene%mesh%elements, wp) + 2.0_wp), &
            'the whole beam at '//short_text(shapes)//' instants', 'give &output a longer shape_step')
      end associate
      ! a Poincare section has an instant, the number of impacts, the logarithm of the size of a variation, and
      ! displacement and velocity of the tip (5 in all), of each contact and of each mode
      numbers = 5 + 2*size(contacts_of(settings))
      if (scene%poincare%records_modes) then
         associate (all => 2*elements_of(scene, scene%mesh%elements), given => scene%response%mode_count)
            numbers = numbers + 2*merge(min(given, all), all, given > 0)
         end associate
      end if
      call add_sections(scene, copies*runs, numbers, need)
   end subroutine add_response

   !> Add the Poincare sections of runs.
   subroutine add_sections(scene, runs, numbers, need)
      type(scene_t), intent(in) :: scene
      !> Number of simultaneous runs, copies included
      real(wp), intent(in) :: runs
      !> Number of values at each section
      integer, intent(in) :: numbers
      type(memory_need_t), intent(inout) :: need

      real(wp) :: recorded

      if (.not. scene%wants_poincare) return
      associate (requested => scene%poincare)
         recorded = real(requested%keep, wp)
         if (.not. requested%sets_duration .and. requested%period > 0.0_wp) recorded = max(0.0_wp, min(recorded, &
            scene%response%duration/requested%period - real(requested%skip, wp)))
         call add_need(need, bytes_of_number*runs*recorded*real(numbers, wp), &
            'the sections of '//short_text(recorded) &
            //' periods', 'give &poincare a smaller keep')
      end associate
   end subroutine add_sections

   !> Number of elements of the finest mesh of a run.
   pure integer function elements_of(scene, given) result(elements)
      type(scene_t), intent(in) :: scene
      !> Number of elements that the scene gives
      integer, intent(in) :: given

      elements = given
      if (scene%mesh%tolerance > 0.0_wp .or. scene%mesh%is_sought) elements = max_elements_found
      if (scene%mesh%estimate) elements = 4*elements
      elements = elements + count_split_elements(scene)
   end function elements_of

   !> Maximum number of elements that are split by stops, supports, masses and section stations.
   pure integer function count_split_elements(scene) result(number)
      type(scene_t), intent(in) :: scene

      number = max(0, size(stops_of(run_settings_of(scene))) - 1)
      if (allocated(scene%supports)) number = number + size(scene%supports)
      if (allocated(scene%masses)) number = number + size(scene%masses)
      if (allocated(scene%beam%section%station)) number = number + size(scene%beam%section%station)
   end function count_split_elements

   !> Add a beam, and its modes if the motion is computed in modes.
   subroutine add_beam(scene, elements, runs, need)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: elements
      !> Number of simultaneous runs
      integer, intent(in) :: runs
      type(memory_need_t), intent(inout) :: need

      character(*), parameter :: advice = 'give &mesh fewer elements'
      ! measured number of reals per element and mode, for the iteration and two sets of modes
      real(wp), parameter :: numbers = 13.0_wp
      ! number of symmetric full matrices of Newmark's method with modal damping ratios, each stored as a half: mass,
      ! stiffness, damping, and factors for each length of the step
      real(wp), parameter :: matrices = 40.0_wp

      if (moves_in_modes(scene%response) .and. takes_few_modes(elements, run_settings_of(scene))) then
         associate (modes => max(scene%response%mode_count, common_count))
            call add_need(need, real(runs, wp)*numbers*bytes_of_number*real(elements, wp)*real(modes, wp), &
               to_text(modes)//' modes of '//to_text(elements)//' elements', advice)
         end associate
      else if (moves_in_modes(scene%response)) then
         call add_modes(elements, runs, advice//", or &response method = 'newmark'", need)
      else
         ! about 800 bytes for each element: skyline matrices, factors and vectors
         call add_need(need, real(runs, wp)*800.0_wp*real(elements, wp), to_text(elements)//' elements', advice)
         if (allocated(scene%mode_ratios)) then
            call add_need(need, real(runs, wp)*matrices*0.5_wp*bytes_of_number*(2.0_wp*real(elements, wp))**2, &
               'the full matrices of '//to_text(elements)//' elements', advice//", or &response method = 'exact'")
         end if
         if (allocated(scene%mode_ratios) .or. is_in_mode(scene%start%start_settings_t)) then
            call add_modes(elements, runs, advice, need)
         end if
      end if
   end subroutine add_beam

   !> Add a sweep: the values of its parameters, and for each thread a beam and the rows of a chunk.
   subroutine add_sweep(scene, workers, need)
      type(scene_t), intent(in) :: scene
      !> Number of threads
      integer, intent(in) :: workers
      type(memory_need_t), intent(inout) :: need

      ! maximum number of cases in a chunk whose size the program chooses
      real(wp), parameter :: max_chunk_cases = 16384.0_wp
      real(wp) :: values, rows, duration
      integer :: chain, k, axes, elements

      axes = 0
      values = 0.0_wp
      do k = 1, size(scene%sweep%swept)
         associate (swept => scene%sweep%swept(k))
            if (.not. is_swept(swept)) cycle
            axes = axes + 1
            if (allocated(swept%list)) then
               values = values + real(size(swept%list), wp)
            else
               values = values + real(max(swept%points, scene%sweep%count), wp)
            end if
         end associate
      end do
      ! one parameter at a time also has a random permutation
      call add_need(need, bytes_of_number*values*(1.0_wp + 0.5_wp/real(max(axes, 1), wp)), 'the parameters of ' &
         //short_text(case_count_of(scene%sweep))//' cases', "give &sweep fewer cases, or design = 'grid'")
      elements = nint(maxval(values_given(scene%sweep%swept(parameter_index('elements', scene%sweep%swept)), &
         real(scene%mesh%elements, wp))))
      call add_beam(scene, elements_of(scene, elements), workers, need)
      if (scene%response%method /= method_exact) then
         duration = maxval(values_given(scene%sweep%swept(parameter_index('duration', scene%sweep%swept)), &
            scene%response%duration))
         call add_need(need, bytes_of_number*real(5*workers, wp)*duration/scene%response%step, &
            'the samples of a case', 'give &response a longer step')
      end if
      rows = real(min(max(scene%sweep%chunk_cases, 0), huge(1)), wp)
      rows = min(max(rows, max_chunk_cases), case_count_of(scene%sweep))*real(workers + 3, wp)
      call add_need(need, bytes_of_number*rows*real(measure_count + axes, wp), 'the rows of parts', &
         'give &sweep fewer part_cases')
      if (.not. (scene%wants_poincare .or. scene%wants_spectrum)) return
      chain = 0
      if (scene%sweep%carry > 0) chain = value_count_of(scene%sweep, scene%sweep%carry)
      rows = real(cases_of_chunk(scene, int(min(case_count_of(scene%sweep), real(huge(1), wp))), chain), wp)
      call add_sections(scene, rows*real(workers + 3, wp), section_values, need)
      call add_need(need, bytes_of_number*rows*real(workers + 3, wp)*real(spectrum_size(scene), wp), &
         'the spectra of parts', 'give &spectrum fewer points')
   end subroutine add_sweep

end module scene_needs
