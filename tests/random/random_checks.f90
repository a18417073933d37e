!> A scene as a user runs it, from the namelist text to the results file, and all that must hold of what it leaves.
module random_checks
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
   use, intrinsic :: iso_c_binding, only: c_funptr, c_int, c_long, c_null_funptr, c_null_ptr
   use analyses, only: analysed_t
   use beam_model, only: beam_model_t
   use failures, only: failure_t, status_bad_input, status_run_failed
   use frequency_types, only: frequency_table_t
   use hdf5_reading, only: has_object, not_finite, opens, read_attribute, read_number_attribute, read_reals
   use history_list, only: eta_stop, eta_tip, force_stop, history_count
   use kinds, only: lambda1, wp
   use load_settings, only: start_release
   use measure_list, only: measure_count, measure_table
   use newmark_limits, only: rounding_of_energy, highest_frequency
   use number_text, only: to_text
   use response_types, only: event_contact, event_impact, response_t
   use run_settings, only: impulse_momentum, law_restitution, method_exact, run_settings_t, stop_settings_t
   use scene_beam_model, only: run_settings_of
   use scene_draft, only: draft_t, drop, has_name, mend, numbered, put, save_text, text_of
   use scene_drawing, only: place_of_parameter, table_file
   use scene_names, only: name_t
   use scene_reader, only: parse_scene, read_scene
   use program_identity, only: program_benchmark, program_motion, program_paper
   use default_mesh, only: find_mesh
   use program_run, only: program_t, run_scene
   use scene_needs, only: memory_need_of_scene
   use scene_run, only: run_motion_scene
   use single_study, only: compute_scene
   use precision_study, only: memory_need_of_precision, run_precision_scene
   use paper_run, only: memory_need_of_statements, run_statements
   use scene_types, only: echo_t, scene_t
   use stop_laws, only: static_stiffness
   use sweep_settings, only: is_swept
   implicit none (type, external)
   private
   public :: open_folder, settle, complaint_of, is_legal, accumulator_t, clean_up

   !> Where the scenes and their results are: a folder of this process, as suites run side by side.
   character(:), allocatable, save :: folder, scene_file
   !> Share of the energy at the start, and of the greatest displacement, that rounding may take
   real(wp), parameter :: rounding = 1.0e-11_wp

   !> What was seen on the way.
   type :: accumulator_t
      integer :: done = 0
      !> Failed in words, as it should
      integer :: failed = 0
      integer :: events = 0
      integer :: rows = 0
   end type accumulator_t

   interface
      !> POSIX: set a timer of this process, which a signal ends.
      function c_setitimer(which, time, before) result(code) bind(c, name='setitimer')
         use, intrinsic :: iso_c_binding, only: c_int, c_long, c_ptr
         implicit none (type, external)
         integer(c_int), value :: which
         !> Seconds and microseconds of the period, and of the time until the signal; 0: the timer is stopped
         integer(c_long), intent(in) :: time(4)
         type(c_ptr), value :: before
         integer(c_int) :: code
      end function c_setitimer
      !> C: the number of this process.
      function c_getpid() result(number) bind(c, name='getpid')
         use, intrinsic :: iso_c_binding, only: c_int
         implicit none (type, external)
         integer(c_int) :: number
      end function c_getpid
      !> C: what a signal does; no handler: what it does by default.
      function c_signal(number, handler) result(before) bind(c, name='signal')
         use, intrinsic :: iso_c_binding, only: c_funptr, c_int
         implicit none (type, external)
         integer(c_int), value :: number
         type(c_funptr), value :: handler
         type(c_funptr) :: before
      end function c_signal
   end interface

contains

   !> Before the first scene.
   subroutine open_folder()
      integer, parameter :: signal_of_timer = 27
      type(c_funptr) :: before

      ! the process that started this one may ignore it
      before = c_signal(signal_of_timer, c_null_funptr)
      folder = 'random_scenes_'//to_text(int(c_getpid()))
      scene_file = folder//'/scene.nml'
      call execute_command_line('rm -rf '//folder//' && mkdir '//folder)
      call save_text(folder//'/'//table_file, '0 0'//new_line('a')//'1 1'//new_line('a')//'2.5 -1 # and so on' &
         //new_line('a')//'4 0'//new_line('a'))
   end subroutine open_folder

   !> Read a draft and drop what the reader refuses, until it does not.
   subroutine settle(draft, scene, complaint)
      !> The draft
      type(draft_t), intent(inout) :: draft
      !> The scene
      type(scene_t), intent(out) :: scene
      !> What is wrong with a refusal; empty: nothing
      character(:), allocatable, intent(out) :: complaint

      type(failure_t), allocatable :: error
      logical :: is_mended

      complaint = ''
      do
         call save_text(scene_file, text_of(draft))
         call read_scene(scene_file, scene, error)
         if (.not. allocated(error)) return
         if (error%status /= status_bad_input .or. index(error%message, scene_file) /= 1 &
            .or. index(error%message, new_line('a')) > 0) complaint = 'refused without file, or in two lines: '
         if (index(error%message, 'requests nothing') > 0) then
            call put(draft, 'frequencies', '', '')
            cycle
         end if
         call mend(draft, error%message(len(scene_file) + 1:), is_mended)
         if (.not. is_mended) complaint = 'refused without group and name: '
         if (complaint /= '') complaint = complaint//error%message
         if (complaint /= '') return
      end do
   end subroutine settle

   !> Run a scene by the program that it is for.
   subroutine run_one(scene, error)
      type(scene_t), intent(in) :: scene
      !> Why it could not be run
      type(failure_t), allocatable, intent(out) :: error

      type(program_t) :: program

      program = program_t(program_motion, '', memory_need_of_scene, run_motion_scene)
      if (scene%wants_statements) program = program_t(program_paper, '', memory_need_of_statements, run_statements)
      if (scene%wants_precision) program = program_t(program_benchmark, '', memory_need_of_precision, &
         run_precision_scene)
      call run_scene(program, scene, folder, 1, .true., error)
   end subroutine run_one

   !> What goes wrong when a scene is run; empty: nothing.
   function complaint_of(names, draft, scene, accumulator) result(complaint)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> The scene in ratios
      type(draft_t), intent(in) :: draft
      !> The same, perhaps in units, as it was read
      type(scene_t), intent(in) :: scene
      !> What was seen
      type(accumulator_t), intent(inout) :: accumulator
      character(:), allocatable :: complaint

      type(failure_t), allocatable :: error
      character(:), allocatable :: file

      file = folder//'/'//scene%name//'.h5'
      call remove(file)
      call limit_time(300_c_long)
      call run_one(scene, error)
      ! a sweep all of whose cases failed has its file with their reasons
      if (allocated(error)) then
         if (scene%wants_sweep .and. index(error%message, 'all ') == 1 .and. index(error%message, ' cases failed') > 0) &
            deallocate (error)
      end if
      if (allocated(error)) then
         complaint = ''
         accumulator%failed = accumulator%failed + 1
         if (.not. is_legal(error%message)) complaint = 'fails: '//error%message
         if (opens(file)) complaint = complaint//'; a file is left by a run that failed'
      else
         accumulator%done = accumulator%done + 1
         complaint = complaint_of_file(file)
         if (scene%wants_sweep) then
            ! of a chain no row is that of a single run
            if (scene%sweep%carry == 0) call compare_rows(names, draft, file, accumulator, complaint)
         else if (scene%wants_cases) then
            call compare_cases(names, draft, scene, file, accumulator, complaint)
         else if (scene%wants_response) then
            call look_closely(scene, file, accumulator, complaint)
         end if
      end if
      call limit_time(0_c_long)
   end function complaint_of

   !> End the process after some seconds of processor time: a loaded machine makes no scene a hanging one.
   subroutine limit_time(seconds)
      !> The time; 0: no limit
      integer(c_long), intent(in) :: seconds

      integer(c_int), parameter :: processor_time = 2
      integer(c_int) :: code

      code = c_setitimer(processor_time, [0_c_long, 0_c_long, seconds, 0_c_long], c_null_ptr)
   end subroutine limit_time

   !> Does a run fail for a reason that its scene allows?
   pure function is_legal(message) result(legal)
      !> What is said
      character(*), intent(in) :: message
      logical :: legal

      character(*), parameter :: reasons(*) = [character(40) :: 'event_limit', 'is too long for this Newmark scheme', &
         'the motion does not advance', 'memory', 'DSYGV: ', 'Lanczos: ', &
         'too uneven', &
         'contact_tolerance is too small', 'must be below half the clearance', &
         'lost in rounding', 'leaves the node at the stop without mass', 'cannot be factorised', 'starts beyond the surface', &
         'cannot be pulled away from a stop', 'nothing carries ', 'rigid stops can be closed', &
         'is for one stop below the beam alone', 'changes the velocity of one node', &
         'the motion does not repeat itself', 'finds no motion that returns', &
         'the mode of the start ', 'displacements of the table ', 'velocities of the table ', &
         'is too near to that of another', 'the stops at ', 'the support at ']
      integer :: i

      legal = any([(index(message, trim(reasons(i))) > 0, i=1, size(reasons))]) .and. index(message, new_line('a')) == 0
   end function is_legal

   !> Numbers that are none, where none may be.
   function complaint_of_file(file) result(complaint)
      !> Name of the file
      character(*), intent(in) :: file
      character(:), allocatable :: complaint

      !> Statistics that every run has, without error bars
      character(*), parameter :: always(5) = [character(16) :: 'mean_force', 'impact_rate', 'contact_share', 'mean_tip', &
         'rms_tip']
      !> Measures of &relay that a contact may not have
      character(*), parameter :: of_closing(6) = [character(20) :: 'bounce_time', 'last_opening', 'final_closing', &
         'minimum_force_closed', 'static_force', 'force_lasts']
      character(:), allocatable :: left
      character(64) :: path
      integer :: i

      complaint = ''
      if (.not. opens(file)) then
         complaint = 'no results file; '
         return
      end if
      left = adjustl(not_finite(file))
      do while (left /= '')
         path = left(:index(left, ' ') - 1)
         left = adjustl(left(len_trim(path) + 1:))
         if (index(path, 'statistics/') > 0 .and. all(always /= path(index(path, '/', back=.true.) + 1:))) cycle
         ! what did not happen or settle, or what a mesh does not have, is NaN by definition
         ! motions without impacts have no speed of one, variations of which nothing is left no logarithm
         if (index(path, 'least_impact_speed') > 0 .or. index(path, 'log_variation') > 0) cycle
         if (index(path, 'measures/') > 0 .or. index(path, 'surfaces/first_impact') > 0 &
            .or. any([(index(path, 'surfaces/'//trim(of_closing(i))) > 0, i=1, size(of_closing))]) &
            .or. index(path, 'surfaces/greatest') > 0 .or. index(path, 'grid/') == 1 &
            .or. index(path, 'frequencies/') == 1 .or. index(path, 'sweep/') == 1 .or. index(path, 'sweep_spectrum/') == 1 &
            .or. index(path, 'best/') == 1 .or. index(path, 'mesh_estimate/') == 1 &
            .or. index(path, 'precision/') == 1 .or. index(path, 'statements/') == 1 &
            .or. &
            (index(path, 'cases/') == 1 .and. index(path, '/', back=.true.) == 6)) cycle
         complaint = complaint//trim(path)//' is not finite; '
      end do
   end function complaint_of_file

   !> One run: everything that must hold of its motion, at its events, at many more instants than it asks for, and
   !> just before and after each event.
   subroutine look_closely(scene, file, accumulator, complaint)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Its results
      character(*), intent(in) :: file
      !> What was seen
      type(accumulator_t), intent(inout) :: accumulator
      !> Gets what is wrong
      character(:), allocatable, intent(inout) :: complaint

      integer, parameter :: samples = 2000
      type(scene_t) :: probe
      type(beam_model_t) :: model
      type(analysed_t), allocatable :: analysed(:)
      type(frequency_table_t), allocatable :: table
      type(response_t), allocatable :: response
      type(failure_t), allocatable :: error
      real(wp), allocatable :: tau(:)

      tau = read_reals(file, 'events/time')
      accumulator%events = accumulator%events + size(tau)
      probe = scene
      call find_mesh(probe)
      probe%wants_frequencies = .false.
      probe%stress%history = .true.
      associate (output => probe%output)
         output%history = .true.
         output%energy = .true.
         output%shape_times = instants_near(tau, scene%response%duration)
         output%shape_step = 0.0_wp
      end associate
      if (scene%response%method == method_exact) probe%response%step = scene%response%duration/real(samples, wp)
      call compute_scene(probe, model, table, response, analysed, error)
      if (allocated(error)) then
         ! Newmark's energy balance is only looked at where one is kept
         if (.not. is_legal(error%message)) complaint = complaint//'fails with other outputs: '//error%message
         return
      end if
      if (response%event_count /= size(tau)) then
         complaint = complaint//'other events with other outputs; '
      else if (size(tau) > 0) then
         if (any(abs(response%events(:size(tau))%tau - tau) > 0.0_wp)) &
            complaint = complaint//'other instants with other outputs; '
      end if
      if (scene%response%method == method_exact) call check_continuity(probe, response, complaint)
      if (scene%response%method == method_exact) call check_shares(file, response, complaint)
      if (scene%response%method == method_exact .and. scene%wants_stress) call check_moments(response, complaint)
      call check_motion(probe, model, response, complaint)
      call check_events(scene, response, complaint)
   end subroutine look_closely

   !> No displacement jumps: from just before an event to just after it the beam moves by what speeds allow. The ledger may
   !> close where it does, because under loads the dissipation in the beam is what is left.
   subroutine check_continuity(scene, response, complaint)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Its motion, with shapes just before and after events
      type(response_t), intent(in) :: response
      !> Gets what is wrong
      character(:), allocatable, intent(inout) :: complaint

      ! of the largest displacement; and the greatest distance of two instants around an event
      real(wp), parameter :: least_jump = 1.0e-8_wp, near = 4.0e-10_wp
      real(wp) :: jump, speed
      integer :: i

      jump = 0.0_wp
      associate (tau => response%shape_tau, y => response%shape_displacement, v => response%shape_velocity)
         do i = 1, size(tau) - 1
            associate (distance => abs(tau(i + 1) - tau(i)))
               ! a massless node that is released moves at once
               if (distance > near .or. .not. tau(i) > near) cycle
               speed = maxval(abs(v(:, i:i + 1)))
               jump = max(jump, maxval(abs(y(:, i + 1) - y(:, i))) - 4.0_wp*speed*distance)
            end associate
         end do
      end associate
      call limit('a displacement jumps by', jump/length_scale(scene, response), least_jump, complaint)
   end subroutine check_continuity

   !> No sample of a moment lies beyond the extremes that were found without samples, by more than is said of them.
   subroutine check_moments(response, complaint)
      !> The motion
      type(response_t), intent(in) :: response
      !> Gets what is wrong
      character(:), allocatable, intent(inout) :: complaint

      real(wp) :: share
      ! beside that of the unit of displacement, about 0.02: what is less is its rounding
      real(wp), parameter :: least_moment = 1.0e-9_wp
      integer :: p

      do p = 1, size(response%moments)
         associate (record => response%moments(p))
            share = 3.0_wp*max(record%minimum_search%tolerance, record%maximum_search%tolerance)
            associate (scale => least_moment + maxval(abs(response%moments%maximum)) + maxval(abs(response%moments%minimum)))
               call limit('a moment exceeds its greatest by', maxval(record%moment) - record%maximum, share*scale, &
                  complaint)
               call limit('a moment falls below its least by', record%minimum - minval(record%moment), share*scale, &
                  complaint)
            end associate
         end associate
      end do
   end subroutine check_moments

   !> Instants around events, in the order of time.
   pure function instants_near(tau, duration) result(instants)
      !> The events
      real(wp), intent(in) :: tau(:)
      !> End of the run
      real(wp), intent(in) :: duration
      real(wp), allocatable :: instants(:)

      integer, parameter :: most_events = 150
      real(wp), parameter :: distances(*) = [1.0e-10_wp, 1.0e-8_wp, 1.0e-6_wp, 1.0e-5_wp, 1.0e-4_wp, 1.0e-3_wp]
      integer :: events, i

      events = min(size(tau), most_events)
      instants = [(tau(i) - distances, tau(i) + distances, i=1, events), &
         (tau(i) + [0.25_wp, 0.5_wp, 0.75_wp]*(tau(i + 1) - tau(i)), i=1, events - 1), 0.5_wp*duration]
      instants = pack(instants, instants >= 0.0_wp .and. instants <= duration)
   end function instants_near

   !> Where the energy went adds up to all of it.
   subroutine check_shares(file, response, complaint)
      !> Results
      character(*), intent(in) :: file
      !> The motion
      type(response_t), intent(in) :: response
      !> Gets what is wrong
      character(:), allocatable, intent(inout) :: complaint

      real(wp) :: shares(5)

      shares = [read_reals(file, 'measures/lost_beam'), read_reals(file, 'measures/lost_stop'), &
         read_reals(file, 'measures/lost_impact'), -read_reals(file, 'measures/created'), &
         read_reals(file, 'measures/left')]
      associate (above => response%measures%start_energy - response%measures%rest_energy)
         if (ieee_is_nan(above)) return
         if (above > rounding*energy_scale(response)) call limit('shares of the energy miss 1 by', abs(sum(shares) - 1.0_wp), &
            rounding*energy_scale(response)/above, complaint)
      end associate
   end subroutine check_shares

   !> Energy at the start, and what the nodal reading created.
   pure function energy_scale(response) result(unit)
      !> The motion, with its energy balance
      type(response_t), intent(in) :: response
      real(wp) :: unit

      unit = max(response%initial_energy, tiny(1.0_wp)) + maxval(response%energy%created)
      if (.not. allocated(response%energy%work)) return
      ! all that goes in and out
      associate (work => response%energy%work)
         unit = unit + sum(abs(work(2:) - work(:size(work) - 1))) + maxval(response%energy%kinetic &
            + response%energy%strain + response%energy%stop)
      end associate
   end function energy_scale

   !> What loads of their full amplitude could give the beam: where they pass through zero, rounding is that of these. A
   !> displacement whose strain is in the energy balance has a rounding error, on which the loads do work.
   pure function energy_of_loads(scene, displacement) result(energy)
      type(scene_t), intent(in) :: scene
      !> How far the beam is bent
      real(wp), intent(in) :: displacement
      real(wp) :: energy

      real(wp), allocatable :: amplitude(:)

      allocate (amplitude(0))
      if (scene%has_forces) amplitude = abs(scene%forces%course%amplitude)
      if (scene%has_bases) amplitude = [amplitude, abs(scene%bases%course%amplitude)]
      energy = 0.5_wp*sum(amplitude**2)*min(scene%response%duration, 1.0_wp)**2 &
         + epsilon(1.0_wp)/rounding*displacement*sum(amplitude)
   end function energy_of_loads

   !> What rounding of displacements and velocities makes of the force of a stop, or of a beam of unit stiffness: a beam that
   !> rests on what it touches is pressed by less.
   pure function least_force(stop, reach) result(force)
      type(stop_settings_t), intent(in) :: stop
      !> Length to which displacements are compared
      real(wp), intent(in) :: reach
      real(wp) :: force

      force = epsilon(1.0_wp)*reach*max(1.0_wp, static_stiffness(stop)*(1.0_wp + stop%branch_ratio), &
         3.0_wp*stop%damper_ratio/lambda1**4)
   end function least_force

   !> How far the beam moves, which a nodal impulse can raise with the energy that it creates. Bodies may move farther, and
   !> so fast that rounding matters: displacements are sums of terms in proportion to velocities, so the displacement at
   !> the start of a phase has an error of a few epsilon times velocity times duration (up to 4 seen for a body of 9000 beam
   !> masses that rides on an overdamped beam; the error is the same multiple of any velocity).
   pure function length_scale(scene, response) result(unit)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Its motion, with its energy balance
      type(response_t), intent(in) :: response
      real(wp) :: unit

      ! rounding errors of a displacement, in epsilon times velocity times duration
      real(wp), parameter :: few = 16.0_wp
      integer :: k

      if (scene%start%kind /= start_release .or. scene%has_bodies .or. allocated(response%energy%work)) then
         ! a tip that is held tells nothing of how far loads bend the beam
         unit = 1.0_wp + greatest_preload(scene) + maxval(abs(response%history(eta_tip)%values)) &
            + sqrt(maxval(response%energy%strain))
         if (.not. scene%has_bodies) return
         do k = 1, size(response%points)
            unit = max(unit, maxval(abs(response%points(k)%displacement)), few*epsilon(1.0_wp)/rounding &
               *scene%response%duration*maxval(abs(response%points(k)%velocity)))
         end do
         return
      end if
      unit = (1.0_wp + greatest_preload(scene)) &
         *sqrt(energy_scale(response)/max(response%initial_energy, tiny(1.0_wp)))
   end function length_scale

   !> The surface that is farthest from the beam, in size.
   pure function greatest_preload(scene) result(preload)
      type(scene_t), intent(in) :: scene
      real(wp) :: preload

      preload = abs(scene%stop%preload)
      if (allocated(scene%more_stops)) preload = max(preload, maxval(abs(scene%more_stops%preload)))
   end function greatest_preload

   !> What must hold at every instant of each surface.
   subroutine check_contacts(scene, response, complaint)
      type(scene_t), intent(in) :: scene
      !> Its motion, everything kept
      type(response_t), intent(in) :: response
      !> Gets what is wrong
      character(:), allocatable, intent(inout) :: complaint

      type(stop_settings_t) :: stop
      real(wp) :: reach
      integer :: k

      reach = length_scale(scene, response)
      do k = 1, size(response%contacts)
         associate (contact => response%contacts(k))
            if (contact%body > 0 .and. contact%is_of_base) then
               stop = scene%bodies(contact%body)%base_contact
            else if (contact%body > 0) then
               stop = scene%bodies(contact%body)%contact
            else if (contact%stop == 1) then
               stop = scene%stop
            else
               stop = scene%more_stops(contact%stop - 1)
            end if
            if (.not. (all(ieee_is_finite(contact%eta)) .and. all(ieee_is_finite(contact%force)))) &
               complaint = complaint//'a surface has what is not finite; '
            call limit('a surface pulls', -(minval(contact%force) + least_force(stop, reach)) &
               /max(maxval(contact%force), response%measures%greatest_force, response%measures%greatest_mean_force, &
               least_force(stop, reach)), rounding, complaint)
            if (stop%law /= law_restitution) cycle
            if (scene%response%method == method_exact) then
               call limit('the beam enters a surface', -minval(real(contact%sign, wp)*contact%eta)/reach, rounding, &
                  complaint)
            else
               call limit('the beam enters a surface', -minval(real(contact%sign, wp)*contact%eta), &
                  scene%response%contact_tolerance + epsilon(1.0_wp)*reach, complaint)
            end if
         end associate
      end do
   end subroutine check_contacts

   !> Newmark's method adds up M, h C and h^2 K: what rounding leaves of M is less by (omega h)^2 of the highest mode, or by
   !> h^2 k/m and h c/m of a body. What opens the energy balance by more than `promised` is refused.
   function rounding_of_steps(model, scene) result(share)
      !> The beam
      type(beam_model_t), intent(in) :: model
      !> The scene, with its step and its bodies
      type(scene_t), intent(in) :: scene
      real(wp) :: share

      type(failure_t), allocatable :: error
      real(wp), parameter :: promised = 1.0e-6_wp
      type(run_settings_t) :: settings
      real(wp) :: frequency

      call rounding_of_energy(model, share, error)
      call highest_frequency(model%stiffness, model%mass, frequency, error)
      if (.not. allocated(error)) share = share + epsilon(1.0_wp)*(frequency*scene%response%step/lambda1**2)**2
      settings = run_settings_of(scene)
      if (scene%has_bodies) share = share + epsilon(1.0_wp)*scene%response%step*maxval(merge(settings%extra_dofs%rate, &
         2.0_wp*(settings%zeta*settings%extra_dofs%square + settings%zeta_mass), settings%extra_dofs%rate >= 0.0_wp) &
         + settings%extra_dofs%square*scene%response%step)
      ! an estimate by the shape at the start, right to its order
      share = min(promised, 1.0e-9_wp + 10.0_wp*share)
   end function rounding_of_steps

   !> The instant of an event is rounded, and so is the phase of each mode then. That is nothing unless the highest ones
   !> hold much energy, which the nodal reading creates there.
   function rounding_of_instants(model, response) result(share)
      !> The beam
      type(beam_model_t), intent(in) :: model
      !> Its motion
      type(response_t), intent(in) :: response
      real(wp) :: share

      type(failure_t), allocatable :: error
      real(wp) :: frequency, longest
      integer :: i

      share = 0.0_wp
      ! a node without mass has no highest frequency
      if (any(model%mass%values(model%mass%diagonal) <= 0.0_wp)) return
      call highest_frequency(model%stiffness, model%mass, frequency, error)
      if (allocated(error) .or. response%event_count == 0) return
      associate (events => response%events(:response%event_count))
         longest = max(events(1)%tau, maxval([(events(i)%tau - events(i - 1)%tau, i=2, size(events))]))
      end associate
      share = epsilon(1.0_wp)*frequency/lambda1**2*longest
   end function rounding_of_instants

   !> What must hold at every instant.
   subroutine check_motion(scene, model, response, complaint)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Its beam
      type(beam_model_t), intent(in) :: model
      !> Its motion, everything kept
      type(response_t), intent(in) :: response
      !> Gets what is wrong
      character(:), allocatable, intent(inout) :: complaint

      real(wp), allocatable :: total(:), at_work(:)
      real(wp) :: unit, reach, share
      integer :: i

      if (.not. (all(ieee_is_finite(response%shape_displacement)) .and. all(ieee_is_finite(response%shape_velocity)))) &
         complaint = complaint//'not finite; '
      do i = 1, history_count
         ! without a stop there is the tip alone
         if (.not. allocated(response%history(i)%values)) cycle
         if (.not. all(ieee_is_finite(response%history(i)%values))) complaint = complaint//'not finite; '
      end do
      associate (e => response%energy)
         at_work = e%kinetic + e%strain + e%stop
         if (allocated(e%work)) at_work = at_work - e%work
         total = at_work + e%dissipated_beam + e%dissipated_stop + e%dissipated_impact - e%created
         unit = energy_scale(response) + energy_of_loads(scene, sqrt(2.0_wp*maxval(e%strain)))
         share = rounding
         if (scene%response%method /= method_exact) then
            share = rounding_of_steps(model, scene)
         else if (scene%stop%impulse /= impulse_momentum) then
            share = rounding + rounding_of_instants(model, response)
         end if
         call limit('ledger open by', maxval(abs(total - response%initial_energy))/unit, share, complaint)
         if (scene%stop%law /= law_restitution .or. scene%stop%impulse == impulse_momentum) then
            call limit('energy created', maxval(e%created)/unit, share, complaint)
            call limit('energy won', maxval(at_work - response%initial_energy)/unit, share, complaint)
            if (scene%response%method == method_exact) call limit('energy won between samples', &
               maxval([(at_work(i + 1) - at_work(i), i=1, size(at_work) - 1)])/unit, share, complaint)
         end if
         call limit('a loss that is a gain', -min(minval(e%dissipated_beam), minval(e%dissipated_stop), &
            minval(e%dissipated_impact), minval(e%created))/unit, share, complaint)
      end associate
      if (.not. (scene%has_stop .or. scene%has_bodies)) return
      reach = length_scale(scene, response)
      associate (force => response%history(force_stop)%values)
         call limit('the stop pulls', -(minval(force) + least_force(scene%stop, reach))/max(maxval(force), &
            response%measures%greatest_force, response%measures%greatest_mean_force, least_force(scene%stop, reach)), &
            rounding, complaint)
      end associate
      if (allocated(response%contacts)) then
         call check_contacts(scene, response, complaint)
         return
      end if
      if (scene%stop%law /= law_restitution) return
      if (scene%response%method == method_exact) then
         call limit('the beam enters the stop', &
            max(-minval(response%history(eta_stop)%values), &
            -minval(response%shape_displacement(model%mesh%stop_node, :)))/reach, &
            rounding, complaint)
      else
         ! between its steps Newmark's method knows nothing
         call limit('the beam enters the stop', -minval(response%history(eta_stop)%values), &
            scene%response%contact_tolerance, complaint)
      end if
   end subroutine check_motion

   !> What must hold at events.
   subroutine check_events(scene, response, complaint)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Its motion
      type(response_t), intent(in) :: response
      !> Gets what is wrong
      character(:), allocatable, intent(inout) :: complaint

      logical, allocatable :: arrives(:)
      integer :: i

      if (response%event_count == 0) return
      associate (events => response%events(:response%event_count), unit => energy_scale(response))
         if (any([(events(i + 1)%tau < events(i)%tau, i=1, size(events) - 1)])) &
            complaint = complaint//'events out of order; '
         if (events(1)%tau < 0.0_wp .or. events(size(events))%tau > scene%response%duration) &
            complaint = complaint//'events outside the run; '
         if (allocated(response%contacts)) return
         ! a rebound too low to count, or to tell from the rounding error of the gap, may be taken back
         arrives = (events%kind == event_impact .or. events%kind == event_contact) .and. &
            [.true., (events(i + 1)%velocity_before*(events(i + 1)%tau - events(i)%tau) &
            > scene%response%hop_tolerance + 64.0_wp*epsilon(1.0_wp)*(1.0_wp + abs(scene%stop%preload)) &
            .or. .not. events(i + 1)%velocity_before > 0.0_wp, i=1, size(events) - 1)]
         if (any(arrives)) then
            call limit('an impulse pulls', -minval(events%impulse, mask=arrives)/max(maxval(events%impulse), &
               tiny(1.0_wp)), rounding, complaint)
            ! a surface that relaxes may catch up with a beam
            if (scene%stop%law == law_restitution) call limit('meets the stop while leaving it', &
               maxval(events%velocity_before, mask=arrives)/max(maxval(abs(events%velocity_before)), tiny(1.0_wp)), &
               rounding, complaint)
         end if
         if (scene%response%method /= method_exact) return
         if (scene%stop%law /= law_restitution) return
         call limit('an event off the stop', maxval(abs(events%eta))/length_scale(scene, response), rounding, &
            complaint)
         if (scene%stop%impulse == impulse_momentum) &
            call limit('an event wins energy', maxval(events%energy_change)/unit, rounding, complaint)
      end associate
   end subroutine check_events

   !> Complain if a number is too large, or none.
   subroutine limit(what, value, most, complaint)
      !> What it would mean
      character(*), intent(in) :: what
      !> The number, and the most it may be
      real(wp), intent(in) :: value
      real(wp), intent(in) :: most
      !> Gets it
      character(:), allocatable, intent(inout) :: complaint

      if (.not. value <= most) complaint = complaint//what//' '//to_text(value)//'; '
   end subroutine limit

   !> The rows of a sweep against single runs.
   subroutine compare_rows(names, draft, file, accumulator, complaint)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> The scene with its sweep
      type(draft_t), intent(in) :: draft
      !> Its results
      character(*), intent(in) :: file
      !> What was seen
      type(accumulator_t), intent(inout) :: accumulator
      !> Gets what differs
      character(:), allocatable, intent(inout) :: complaint

      type(draft_t) :: single
      type(scene_t) :: scene, whole
      type(failure_t), allocatable :: error
      character(:), allocatable :: path, single_file
      real(wp), allocatable :: column(:), status(:)
      integer :: i, k

      status = read_reals(file, 'sweep/status')
      call parse_scene(text_of(draft), 'draft.nml', whole, error)
      do i = 1, size(status)
         accumulator%rows = accumulator%rows + 1
         single = numbered(draft)
         call drop(single, 'sweep', '')
         call drop(single, 'best', '')
         call put_found_mesh(file, single)
         call give_ratios(names, whole%echo, single)
         ! rows of several durations have the frequencies of the longest one
         if (whole%wants_spectrum .and. .not. has_name(draft, 'spectrum', 'points') .and. &
            any(is_swept(whole%sweep%swept) .and. [(index(whole%sweep%swept(k)%parameter%name, 'duration') == 1, &
            k=1, size(whole%sweep%swept))])) &
            call put(single, 'spectrum', 'resolution_ratio', to_text(whole%spectrum%resolution))
         do k = 1, size(whole%sweep%swept)
            associate (parameter => whole%sweep%swept(k)%parameter)
               column = read_reals(file, 'sweep/'//trim(parameter%name))
               if (size(column) > 0) call put_parameter(names, trim(parameter%name), column(i), file, single)
            end associate
         end do
         call put(single, 'scene', 'name', '''single''')
         call put(single, 'output', 'histories', '''none''')
         call save_text(folder//'/single.nml', text_of(single))
         call read_scene(folder//'/single.nml', scene, error)
         if (.not. allocated(error)) call run_one(scene, error)
         if (allocated(error) .neqv. status(i) > 0.0_wp) then
            complaint = complaint//'row '//to_text(i)//' fails, or its single run does; '
            if (allocated(error)) complaint = complaint//error%message
         end if
         if (allocated(error)) cycle
         single_file = folder//'/single.h5'
         do k = 1, measure_count
            path = path_of_measure(single_file, trim(measure_table(k)%run_name))
            if (path == '') cycle
            column = read_reals(file, 'sweep/'//trim(measure_table(k)%name))
            call compare('row '//to_text(i)//' '//trim(measure_table(k)%name), column(i), read_reals(single_file, path), &
               complaint)
         end do
      end do
   end subroutine compare_rows

   !> Give a scene without a mesh the mesh that was found for all its cases: a case by itself may find another one.
   subroutine put_found_mesh(file, draft)
      !> Results of the cases
      character(*), intent(in) :: file
      !> Gets the mesh
      type(draft_t), intent(inout) :: draft

      if (has_name(draft, 'mesh', 'elements') .or. has_name(draft, 'mesh', 'nodes')) return
      call put(draft, 'mesh', 'elements', to_text(nint(read_number_attribute(file, 'scene/mesh', 'elements'))))
      call drop(draft, 'mesh', 'ratio')
      call put(draft, 'mesh', 'ratio', to_text(read_number_attribute(file, 'scene/mesh', 'ratio')))
   end subroutine put_found_mesh

   !> Give a parameter of a sweep its value in a scene without one.
   subroutine put_parameter(names, parameter, value, file, draft)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> The parameter
      character(*), intent(in) :: parameter
      !> Its value
      real(wp), intent(in) :: value
      !> Results of the sweep
      character(*), intent(in) :: file
      !> Gets it
      type(draft_t), intent(inout) :: draft

      character(:), allocatable :: group, name
      integer :: i

      call place_of_parameter(names, parameter, group, name)
      if (name == 'taper') then
         ! the mean height is kept
         call drop(draft, 'beam', 'height_root')
         call drop(draft, 'beam', 'height_tip')
         call put(draft, 'beam', 'mean_height_ratio', to_text(read_number_attribute(file, 'scene/scales', &
            'height_ratio')))
      end if
      ! a ratio that stands there would contradict it
      do i = 1, size(names)
         if (names(i)%group == group .and. names(i)%name == name .and. names(i)%is_physical) &
            call drop(draft, group, trim(names(i)%instead_of))
      end do
      if (name == 'elements') then
         call put(draft, group, name, to_text(nint(value)))
      else
         call put(draft, group, name, to_text(value))
      end if
   end subroutine put_parameter

   !> Ratios instead of units, which a swept parameter would contradict, or change the ratios of.
   subroutine give_ratios(names, echo, draft)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> What the draft came to
      type(echo_t), intent(in) :: echo(:)
      type(draft_t), intent(inout) :: draft

      character(:), allocatable :: group, name, ratio
      integer :: i, k

      do i = 1, size(names)
         group = trim(names(i)%group)
         name = trim(names(i)%name)
         ratio = trim(names(i)%instead_of)
         if (.not. names(i)%is_physical .or. .not. has_name(draft, group, name)) cycle
         call drop(draft, group, name)
         do k = 1, size(echo)
            if (echo(k)%group == group .and. echo(k)%name == ratio) call put(draft, group, ratio, to_text(echo(k)%number(1)))
         end do
      end do
   end subroutine give_ratios

   !> Where the file of a single run holds a measure; empty: nowhere.
   function path_of_measure(file, measure) result(path)
      !> The file
      character(*), intent(in) :: file
      !> Its name there; empty: it has none
      character(*), intent(in) :: measure
      character(:), allocatable :: path

      path = 'measures/'//measure
      if (measure == '' .or. .not. has_object(file, path)) path = ''
   end function path_of_measure

   !> Two numbers that should be the same; NaN stands for nothing.
   subroutine compare(what, value, other, complaint)
      !> What they are
      character(*), intent(in) :: what
      !> One of them, and the other, perhaps absent
      real(wp), intent(in) :: value
      real(wp), intent(in) :: other(:)
      !> Gets the difference
      character(:), allocatable, intent(inout) :: complaint

      real(wp), parameter :: same = 1.0e-10_wp

      if (.not. ieee_is_finite(value)) then
         if (size(other) == 0) return
         if (.not. ieee_is_finite(other(1))) return
      else if (size(other) > 0) then
         if (abs(value - other(1)) <= same*max(1.0_wp, abs(value))) return
      end if
      complaint = complaint//what//' '//to_text(value)
      if (size(other) > 0) complaint = complaint//' alone '//to_text(other(1))
      complaint = complaint//'; '
   end subroutine compare

   !> The cases of a scene against single runs.
   subroutine compare_cases(names, draft, scene, file, accumulator, complaint)
      !> The table of names
      type(name_t), intent(in) :: names(:)
      !> The scene with its cases
      type(draft_t), intent(in) :: draft
      !> The same as read
      type(scene_t), intent(in) :: scene
      !> Its results
      character(*), intent(in) :: file
      !> What was seen
      type(accumulator_t), intent(inout) :: accumulator
      !> Gets what differs
      character(:), allocatable, intent(inout) :: complaint

      character(*), parameter :: lists(*) = [character(26) :: 'events/time', 'events/energy_change', &
         'response/displacement_stop', &
         'response/contact_force', 'energy/strain', 'measures/peak']
      ! what is small beside the preload has lost digits to it: lengths once, energies twice
      integer, parameter :: powers(size(lists)) = [0, 2, 1, 1, 2, 1]
      type(draft_t) :: single
      type(scene_t) :: alone
      type(failure_t), allocatable :: error
      character(:), allocatable :: parameter, reason
      real(wp), allocatable :: here(:), there(:)
      real(wp) :: tolerance
      integer :: i, k

      do i = 1, size(scene%cases%list)
         accumulator%rows = accumulator%rows + 1
         single = numbered(draft)
         parameter = trim(scene%cases%parameter%name)
         call put_found_mesh(file, single)
         call put_parameter(names, parameter, scene%cases%list(i), file, single)
         call drop(single, 'cases', '')
         call put(single, 'scene', 'name', '''single''')
         call save_text(folder//'/single.nml', text_of(single))
         call read_scene(folder//'/single.nml', alone, error)
         if (.not. allocated(error)) call run_one(alone, error)
         reason = read_attribute(file, 'cases/case_'//to_text(i), 'failure_reason')
         if (allocated(error) .neqv. reason /= '') then
            if (reason == '') reason = 'alone '//error%message
            complaint = complaint//'case '//to_text(i)//' fails only '//reason
            return
         end if
         if (reason /= '' .and. .not. is_legal(reason)) complaint = complaint//'fails: '//reason//'; '
         if (reason /= '') cycle
         do k = 1, size(lists)
            there = read_reals(folder//'/single.h5', trim(lists(k)))
            here = read_reals(file, 'cases/case_'//to_text(i)//'/'//trim(lists(k)))
            if (size(here) /= size(there)) then
               complaint = complaint//'case '//to_text(i)//': '//trim(lists(k))//' is longer or shorter alone; '
            else if (size(here) > 0) then
               tolerance = 1.0e-10_wp
               ! Newmark's reaction is made of forces of the shortest element, and those of rounding
               if (lists(k) == 'response/contact_force' .and. alone%response%method /= method_exact) tolerance = 1.0e-5_wp
               call limit('case '//to_text(i)//' alone: '//trim(lists(k))//' differs by', maxval(abs(here - there)), &
                  tolerance*max((1.0_wp + greatest_preload(alone))**powers(k), maxval(abs(there))), complaint)
            end if
         end do
         call look_closely(alone, folder//'/single.h5', accumulator, complaint)
      end do
   end subroutine compare_cases

   !> Remove a file that may be there.
   subroutine remove(file)
      !> Name of the file
      character(*), intent(in) :: file

      integer :: unit, code

      open (newunit=unit, file=file, status='old', iostat=code)
      if (code == 0) close (unit, status='delete')
   end subroutine remove

   !> After the last scene.
   subroutine clean_up()
      call execute_command_line('rm -rf '//folder)
   end subroutine clean_up

end module random_checks
