!> A scene by Newmark's steps of three lengths beside its exact motion, up to the first contact.
module newmark_convergence
   use applied_loads, only: applied_loads_t, gather_loads, has_loads
   use beam_model, only: beam_model_t, constrain_supports
   use failures, only: failure_t
   use free_modes, only: find_free_modes, free_modes_t
   use history_list, only: eta_stop, eta_tip, velocity_stop
   use kinds, only: lambda1, wp
   use load_settings, only: course_harmonic, course_pulse, course_table, time_course_t
   use motion_run, only: run_motion
   use newmark_loads, only: prepare_loads
   use newmark_run, only: newmark_run_t
   use newmark_limits, only: highest_frequency
   use number_text, only: to_text
   use response_types, only: event_t, response_t
   use run_settings, only: method_exact, run_settings_t
   use scene_beam_model, only: model_of, run_settings_of
   use random_checks, only: is_legal
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: complaint_of_steps

   !> Steps of length h, h/2 and h/4.
   integer, parameter :: lengths = 3
   !> Steps that seem wrong are taken at least so many times shorter, and at most.
   integer, parameter :: shorter = 4, shortest = 64
   !> What second order leaves of an error, and how much more it may be beside terms of higher order.
   real(wp), parameter :: quarter = 0.25_wp, freedom = 1.5_wp
   !> That of all runs.
   real(wp), parameter :: contact_tolerance = 1.0e-12_wp
   !> What rounding may be of a quantity.
   real(wp), parameter :: rounding_of_size = 1.0e-8_wp
   !> So many steps lie at least between the last jump of a load and a contact whose error goes with their square. Steps of
   !> any length h reach both instants, a distance D apart, by shorter steps, each half as long as the one before. What is
   !> wrong by the cube of each piece is so wrong by h^2 D at most, and at least by h^2 (D - 2 h (1 - 1/7)): each end lacks a
   !> step but for the cubes of the pieces. Half the step leaves no more than `freedom` times a quarter where
   !> D <= freedom (D - 12/7 h), which is D >= 5.2 h.
   real(wp), parameter :: steps_between = 6.0_wp

   !> What loads are, beside the motion that they make.
   type :: loading_t
      !> Instants at which they jump, ascending
      real(wp), allocatable :: jumps(:)
      !> Energy of the modes as they follow the loads without vibration. Exact motion is the sum of this and of free
      !> vibration, however little is left of both, and so are its energies and the work.
      real(wp) :: energy = 0.0_wp
   end type loading_t

   !> A quantity at the samples.
   type :: signal_t
      character(24) :: name = ''
      real(wp), allocatable :: values(:)
      !> What rounding is a share of
      real(wp) :: size = 0.0_wp
      !> Whose it is; 0: no surface's
      integer :: contact = 0
   end type signal_t

contains

   !> What differs; empty: nothing.
   function complaint_of_steps(scene, is_compared, is_refined) result(complaint)
      !> Read, of method 'newmark'
      type(scene_t), intent(in) :: scene
      !> It could be
      logical, intent(out) :: is_compared
      !> The longest steps did not show the order, so that shorter ones were taken
      logical, intent(out) :: is_refined
      character(:), allocatable :: complaint

      type(beam_model_t) :: model
      type(run_settings_t) :: settings
      type(response_t) :: exact, steps(lengths)
      type(loading_t) :: loading
      type(failure_t), allocatable :: error
      real(wp) :: h
      integer :: every

      complaint = ''
      is_compared = .false.
      is_refined = .false.
      call model_of(scene, scene%mesh%elements, scene%mesh%ratio, model, error, moves=.true.)
      settings = run_settings_of(scene)
      if (.not. allocated(error)) call set_steps(model, settings, h, error)
      if (allocated(error)) return
      if (.not. h > 0.0_wp) return
      settings%response%contact_tolerance = contact_tolerance
      settings%response%keep_all_modes = .true.
      settings%output%history = scene%has_stop
      settings%output%history(eta_tip) = .true.
      settings%output%energy = .true.
      call describe_loads(model, settings, loading)
      call run_exactly(model, settings, h, exact, error)
      if (.not. allocated(error)) then
         if (.not. settings%response%duration > 0.0_wp) return
         call run_in_steps(model, settings, h, steps, error)
      end if
      if (.not. allocated(error)) then
         is_compared = .true.
         call compare(exact, steps, loading, 1, h, complaint)
         if (complaint == '') return
         ! too long for the order to show, or after a jump all as short as that asks for: what is wrong stays so
         is_refined = .true.
         every = shorter
         do while (every < shortest .and. .not. shows_order(exact, loading, h/real(every, wp)))
            every = 2*every
         end do
         call run_in_steps(model, settings, h/real(every, wp), steps, error)
         complaint = ''
         if (.not. allocated(error)) call compare(exact, steps, loading, every, h, complaint)
      end if
      if (allocated(error)) then
         if (.not. is_legal(error%message)) complaint = error%message
      end if
   end function complaint_of_steps

   !> Runs by steps of a length, its half and its quarter.
   subroutine run_in_steps(model, settings, longest, steps, error)
      type(beam_model_t), intent(in) :: model
      !> Its step changes
      type(run_settings_t), intent(inout) :: settings
      real(wp), intent(in) :: longest
      type(response_t), intent(out) :: steps(lengths)
      type(failure_t), allocatable, intent(out) :: error

      integer :: i

      do i = 1, lengths
         settings%response%step = scale(longest, 1 - i)
         call run_motion(model, settings, steps(i), error)
         if (allocated(error)) return
      end do
   end subroutine run_in_steps

   !> A step that turns the fastest mode, load or decay by little over a step, and by little too much over the run;
   !> breaks of tables are moved to its multiples, as steps go over them.
   subroutine set_steps(model, settings, h, error)
      type(beam_model_t), intent(in) :: model
      !> Duration and courses of loads may change
      type(run_settings_t), intent(inout) :: settings
      !> 0: too short a step
      real(wp), intent(out) :: h
      !> Set where the stiffness cannot be factorised
      type(failure_t), allocatable, intent(out) :: error

      ! (h W)^2 W T of the fastest mode, and h W
      real(wp), parameter :: most_late = 0.2_wp, most_turned = 0.05_wp
      real(wp), parameter :: max_steps = 1.0e4_wp, shortest = 0.02_wp
      type(beam_model_t) :: held
      real(wp) :: fastest, rate
      integer :: i

      held = constrain_supports(model)
      h = 0.0_wp
      if (any(held%mass%values(held%mass%diagonal) <= 0.0_wp)) return
      call highest_frequency(held%stiffness, held%mass, fastest, error)
      if (allocated(error)) return
      fastest = fastest/lambda1**2
      rate = max(fastest, 2.0_wp*(settings%zeta*fastest**2 + settings%zeta_mass))
      if (allocated(settings%forces)) rate = max(rate, maxval(rate_of(settings%forces%course)))
      if (allocated(settings%bases)) rate = max(rate, maxval(rate_of(settings%bases%course)))
      associate (duration => settings%response%duration)
         duration = min(duration, (max_steps**2*most_late)**(1.0_wp/3.0_wp)/fastest, max_steps*most_turned/rate)
         if (duration < shortest) return
         h = min(most_turned/rate, sqrt(most_late/(fastest**3*duration)))
         h = duration/aint(1.0_wp + duration/h)
      end associate
      if (allocated(settings%forces)) then
         do i = 1, size(settings%forces)
            call round_breaks(h, settings%forces(i)%course)
         end do
      end if
      if (.not. allocated(settings%bases)) return
      do i = 1, size(settings%bases)
         call round_breaks(h, settings%bases(i)%course)
      end do
   end subroutine set_steps

   !> Their jumps, and the energy of the beam that follows them.
   subroutine describe_loads(model, settings, loading)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      type(loading_t), intent(out) :: loading

      type(newmark_run_t) :: run
      type(applied_loads_t) :: loads
      type(free_modes_t) :: modes
      type(failure_t), allocatable :: error
      real(wp) :: rate, value
      integer :: g

      call prepare_loads(constrain_supports(model), settings, run)
      call move_alloc(run%jumps, loading%jumps)
      if (.not. has_loads(settings)) return
      call find_free_modes(model, modes, error)
      if (allocated(error)) return
      call gather_loads(model, settings, loads)
      do g = 1, loads%count
         associate (course => loads%course(g))
            value = abs(course%amplitude)
            rate = value*loads%frequency(g)
            if (course%kind == course_table) then
               rate = value*maxval(abs((course%value(2:) - course%value(:size(course%value) - 1)) &
                  /(course%time(2:) - course%time(:size(course%time) - 1))))
               value = value*maxval(abs(course%value))
            end if
         end associate
         ! slow modes go along with a load from where they are
         associate (force => matmul(loads%vector(:, g), modes%mode), square => modes%square)
            loading%energy = loading%energy + 0.5_wp*sum(force**2*(value**2/square + (rate/square)**2), &
               mask=sqrt(square) >= loads%slow)
         end associate
      end do
   end subroutine describe_loads

   !> Are steps so short that the error of the first contact goes with their square?
   pure function shows_order(exact, loading, step) result(shows)
      type(response_t), intent(in) :: exact
      type(loading_t), intent(in) :: loading
      real(wp), intent(in) :: step
      logical :: shows

      shows = .true.
      if (exact%event_count == 0) return
      associate (contact => exact%events(1)%tau)
         shows = contact - maxval([0.0_wp, pack(loading%jumps, loading%jumps < contact)]) >= steps_between*step
      end associate
   end function shows_order

   !> How fast a load changes.
   elemental function rate_of(course) result(rate)
      type(time_course_t), intent(in) :: course
      real(wp) :: rate

      rate = 0.0_wp
      if (course%kind == course_harmonic) rate = course%frequency
      if (course%kind == course_pulse) rate = 1.0_wp/course%duration
      if (course%kind /= course_table) return
      associate (t => course%time)
         ! no more than that breaks stay apart
         rate = 0.1_wp/minval(t(2:) - t(:size(t) - 1))
      end associate
   end function rate_of

   !> The inner breaks of a table become multiples of the step.
   pure subroutine round_breaks(h, course)
      real(wp), intent(in) :: h
      type(time_course_t), intent(inout) :: course

      if (course%kind /= course_table .or. h <= 0.0_wp) return
      associate (inner => course%time(2:size(course%time) - 1))
         inner = h*anint((course%start + inner)/h) - course%start
      end associate
   end subroutine round_breaks

   !> The exact motion; runs by steps are to end soon after its first contact.
   subroutine run_exactly(model, settings, h, exact, error)
      type(beam_model_t), intent(in) :: model
      !> Duration changes; 0: it begins with a contact
      type(run_settings_t), intent(inout) :: settings
      real(wp), intent(in) :: h
      type(response_t), intent(out) :: exact
      type(failure_t), allocatable, intent(out) :: error

      type(run_settings_t) :: whole

      whole = settings
      whole%response%method = method_exact
      whole%response%step = h
      call run_motion(model, whole, exact, error)
      if (allocated(error)) return
      if (exact%event_count == 0) return
      associate (duration => settings%response%duration, contact => exact%events(1)%tau)
         duration = min(duration, h*(aint(contact/h) + 2.0_wp))
         if (contact < h) duration = 0.0_wp
      end associate
   end subroutine run_exactly

   !> Each quantity errs a quarter as much at half the step, and so does the instant of the first contact.
   subroutine compare(exact, steps, loading, every, h, complaint)
      type(response_t), intent(in) :: exact
      type(response_t), intent(in) :: steps(lengths)
      type(loading_t), intent(in) :: loading
      !> So many of the longest steps from one sample of the exact motion to the next
      integer, intent(in) :: every
      !> The distance of these
      real(wp), intent(in) :: h
      !> Gets what does not
      character(:), allocatable, intent(inout) :: complaint

      ! of the extent of a quantity: the error of the longest step, and rounding
      real(wp), parameter :: most_wrong = 0.2_wp, rounding = 1.0e-7_wp
      type(signal_t), allocatable :: expected(:), found(:)
      real(wp), allocatable :: errors(:, :)
      real(wp) :: extent, last, least
      integer :: i, k, samples

      last = h*real((size(steps(1)%tau) - 1)/every + 1, wp)
      if (exact%event_count > 0) last = exact%events(1)%tau
      do i = 1, lengths
         if (steps(i)%event_count > 0) last = min(last, steps(i)%events(1)%tau)
      end do
      samples = min((size(steps(1)%tau) - 1)/every + 1, int(last/h + 0.5_wp))
      ! the run starts in contact, or meets it before there is an extent
      if (samples < 2) return
      call gather(exact, loading, 1, samples, expected)
      allocate (errors(lengths, size(expected)))
      do i = 1, lengths
         call gather(steps(i), loading, every*2**(i - 1), samples, found)
         errors(i, :) = [(maxval(abs(found(k)%values - expected(k)%values)), k=1, size(expected))]
      end do
      do k = 1, size(expected)
         associate (values => expected(k)%values, error => errors(:, k))
            extent = maxval(values) - minval(values)
            least = rounding*extent + rounding_of_size*expected(k)%size
            if (error(1) <= most_wrong*extent + least .and. &
               all(error(2:) <= freedom*[quarter, quarter**2]*error(1) + least)) cycle
            complaint = complaint//trim(expected(k)%name)//' errs by '//to_text(error(1)/extent)//', '// &
               to_text(error(2)/extent)//', '//to_text(error(3)/extent)//'; '
         end associate
      end do
      if (complaint /= '' .or. exact%event_count == 0) return
      ! no steps that are taken tell of a contact so soon after a jump
      if (every >= shortest .and. .not. shows_order(exact, loading, h/real(every, wp))) return
      call compare_contacts(exact, steps, expected, errors, h, complaint)
   end subroutine compare

   !> The first contact is one of the same surface, as soon as the errors there allow.
   subroutine compare_contacts(exact, steps, expected, errors, h, complaint)
      type(response_t), intent(in) :: exact
      type(response_t), intent(in) :: steps(lengths)
      type(signal_t), intent(in) :: expected(:)
      !> Of these, [lengths, signals]
      real(wp), intent(in) :: errors(:, :)
      !> The distance of samples
      real(wp), intent(in) :: h
      character(:), allocatable, intent(inout) :: complaint

      ! of the greatest speed there: what is slower grazes
      real(wp), parameter :: slow = 0.1_wp
      type(event_t) :: found(lengths)
      ! distance of the beam from the surface at the instants that were found
      real(wp) :: fallen(lengths)
      real(wp) :: acceleration, late
      integer :: i, place, speed

      associate (contact => exact%events(1))
         place = findloc(expected%contact == contact%contact .and. expected%name == 'eta', .true., dim=1)
         speed = findloc(expected%contact == contact%contact .and. expected%name == 'velocity', .true., dim=1)
         if (abs(contact%velocity_before) < slow*maxval(abs(expected(speed)%values))) return
         if (any(steps%event_count == 0)) then
            complaint = complaint//'no contact; '
            return
         end if
         found = [(steps(i)%events(1), i=1, lengths)]
         if (any(found%kind /= contact%kind .or. found%contact /= contact%contact)) complaint = 'another contact; '
         associate (v => expected(speed)%values)
            acceleration = maxval([0.0_wp, abs(v(2:) - v(:size(v) - 1))])/h
         end associate
         fallen = abs((found%tau - contact%tau)*contact%velocity_before)
         if (.not. acceleration > 0.0_wp) then
            ! the beam has rested on the surface until now, when a load presses it down
            acceleration = acceleration_after(exact, h)
            fallen = 0.5_wp*acceleration*(found%tau - contact%tau)**2
         end if
         if (.not. falls(fallen, errors(:, place), rounding_of_size*expected(place)%size)) complaint = &
            complaint//'instants of contact err by '// &
            to_text(found(1)%tau - contact%tau)//', '//to_text(found(3)%tau - contact%tau)//'; '
         ! a contact is found when the gap is within the tolerance of contact: from speed v the acceleration a changes the
         ! speed over this distance by less than a tolerance/v, and by less than from rest
         late = acceleration*contact_tolerance/max(abs(contact%velocity_before), sqrt(tiny(1.0_wp)))
         late = min(late, sqrt(2.0_wp*acceleration*contact_tolerance))
         if (.not. falls(abs(found%velocity_before - contact%velocity_before), errors(:, speed), &
            rounding_of_size*expected(speed)%size + late)) complaint = complaint//'speeds of contact err by '// &
            to_text(found(1)%velocity_before - contact%velocity_before)//', ' &
            //to_text(found(3)%velocity_before - contact%velocity_before)//'; '
      end associate
   end subroutine compare_contacts

   !> Greatest mean acceleration from the first contact to either of the two samples behind it.
   pure function acceleration_after(exact, h) result(acceleration)
      type(response_t), intent(in) :: exact
      !> The distance of samples
      real(wp), intent(in) :: h
      real(wp) :: acceleration

      real(wp), allocatable :: v(:)
      integer :: i, next

      associate (contact => exact%events(1))
         if (allocated(exact%contacts)) then
            v = exact%contacts(contact%contact)%velocity
         else
            v = exact%history(velocity_stop)%values
         end if
         next = int(contact%tau/h) + 2
         acceleration = maxval([(abs(v(i))/(h*real(i - 1, wp) - contact%tau), i=next + 1, min(next + 2, size(v)))])
      end associate
   end function acceleration_after

   !> Does a single error fall with the square of the step? It may pass through zero: then it is not above others that do.
   pure function falls(error, others, least) result(does)
      !> For each length of the step
      real(wp), intent(in) :: error(lengths)
      real(wp), intent(in) :: others(lengths)
      !> What may be rounding
      real(wp), intent(in) :: least
      logical :: does

      ! errors may grow until the contact
      real(wp), parameter :: grown = 4.0_wp

      does = all(error <= grown*others + least) .or. all(error(2:) <= freedom*[quarter, quarter**2]*error(1) + least)
   end function falls

   !> All that is compared, at the samples of the longest step.
   subroutine gather(response, loading, stride, samples, signals)
      type(response_t), intent(in) :: response
      type(loading_t), intent(in) :: loading
      !> Samples from one to the next
      integer, intent(in) :: stride
      !> How many are taken
      integer, intent(in) :: samples
      type(signal_t), allocatable, intent(out) :: signals(:)

      ! of sines, products and sums of a mode
      real(wp), parameter :: roundings = 32.0_wp*epsilon(1.0_wp)
      real(wp) :: exchanged, whole
      integer :: k

      whole = maxval(response%energy%kinetic + response%energy%strain)
      allocate (signals(0))
      call add('tip', response%history(eta_tip)%values, sqrt(whole))
      if (allocated(response%contacts)) then
         do k = 1, size(response%contacts)
            call add('eta', response%contacts(k)%eta, sqrt(whole), k)
            call add('velocity', response%contacts(k)%velocity, sqrt(whole), k)
         end do
      else
         call add('eta', response%history(eta_stop)%values, sqrt(whole), 1)
         call add('velocity', response%history(velocity_stop)%values, sqrt(whole), 1)
      end if
      exchanged = max(whole, roundings/rounding_of_size*loading%energy)
      associate (energy => response%energy)
         call add('kinetic', energy%kinetic, exchanged)
         call add('strain', energy%strain, exchanged)
         call add('dissipated_beam', energy%dissipated_beam, exchanged)
         if (allocated(energy%work)) call add('work', energy%work, exchanged)
      end associate
      if (.not. allocated(response%moments)) return
      do k = 1, size(response%moments)
         call add('moment', response%moments(k)%moment, sqrt(whole))
      end do

   contains

      subroutine add(name, values, least_size, contact)
         character(*), intent(in) :: name
         real(wp), intent(in) :: values(:)
         !> What rounding is a share of, at least
         real(wp), intent(in) :: least_size
         !> Whose it is
         integer, intent(in), optional :: contact

         type(signal_t) :: signal
         integer :: i

         signal%name = name
         if (present(contact)) signal%contact = contact
         signal%size = max(least_size, maxval(abs(values)))
         allocate (signal%values(samples))
         signal%values(:) = [(values(1 + stride*(i - 1)), i=1, samples)]
         signals = [signals, signal]
      end subroutine add

   end subroutine gather

end module newmark_convergence
