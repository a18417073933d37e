!> The beam and the stop through time, the paper's way: Newmark steps, halved at an event until the condition of
!> the stop is met (docs/theory.md, section 10).
!>
!> Every state stands at a dyadic fraction of the step; after an event the steps grow again as fast as
!> this grid allows, so that the samples are met exactly. A step is taken back by not changing to the state that it
!> led to.
module newmark_motion
   use beam_model, only: beam_model_t, static_shape
   use failures, only: fail, failure_t, status_bad_input, status_run_failed
   use kinds, only: i8, lambda1_power4, wp
   use newmark_energies, only: beam_dissipation, kinetic_energy, strain_energy
   use newmark_events, only: give_way, look_for_event
   use newmark_run, only: gap, instant, level_of, nowhere, phase_contact, phase_free, phase_held, run_t, stop_energy, &
      whole_step
   use newmark_samples, only: keep_shapes, take_sample
   use newmark_stability, only: critical_step, highest_frequency, is_unconditionally_stable
   use newmark_stepper, only: change_force, deepest_level, finish_step, make_factors, make_newmark_stepper, &
      make_start_state, predict_step
   use number_text, only: to_text
   use response_records, only: open_records
   use response_types, only: miss_of_energies, response_t
   use run_measures, only: start_tally
   use run_reach, only: tell_reach
   use run_settings, only: count_samples, response_settings_t, run_settings_t
   use skyline_matrix, only: multiply, skyline_t
   use step_measures, only: finish_steps, measure_contact, measure_energy, measure_motion, piece_t
   use stop_laws, only: make_yielding_stop
   use yielding_stop, only: contact_force, mean_force_coefficients
   implicit none (type, external)
   private
   public :: newmark_response, check_newmark, rounding_of_energy
   public :: divide_step, check_mesh, blame_mesh, check_ledger

contains

   !> The motion from rest in the static shape, eta_c = 1, until the end of the run.
   subroutine newmark_response(model, settings, response, error)
      type(beam_model_t), intent(in) :: model
      !> Stop, damping, steps, tolerances, output
      type(run_settings_t), intent(in) :: settings
      !> Events and histories
      type(response_t), intent(out) :: response
      !> Set when the step is too long for the scheme, an event cannot be located, or rounding opens the ledger
      type(failure_t), allocatable, intent(out) :: error

      ! at least so many samples, if there are, are held against the ledger where energies are no output
      integer, parameter :: fewest_checks = 8
      type(run_t) :: run
      integer :: between_checks, samples
      real(wp) :: miss

      call make_run(model, settings, run, error)
      if (allocated(error)) return
      samples = count_samples(settings%response%duration, settings%response%step)
      between_checks = max(1, samples/fewest_checks)
      call open_records(model%mesh%elements, settings%output, samples, settings%response%step, response)
      run%keeps_measures = settings%output%measures
      run%keeps_ledger = allocated(response%energy) .or. run%keeps_measures
      run%keeps_shapes = allocated(response%shape_tau)
      run%root_dofs = model%root_dofs
      call strain_energy(run%stepper, run%states(1), response%initial_energy)
      call start_tally(settings%stop, response%initial_energy, settings%height_ratio, run%progress%measurer%tally)
      if (run%keeps_shapes) then
         call keep_shapes(run%root_dofs, run%states(1), run%states(1), 0.0_wp, 0.0_wp, settings%stop%preload, &
            run%progress%next_shape, response)
      end if
      call take_sample(run, response)

      do while (run%progress%sample < samples)
         call advance(run, response)
         if (allocated(run%error)) then
            call move_alloc(run%error, error)
            return
         end if
         if (run%progress%part > 0 .or. run%progress%offset > 0_i8) cycle
         call take_sample(run, response)
         call tell_reach(real(run%progress%sample, wp), real(samples, wp))
         if (.not. run%keeps_ledger .or. modulo(samples - run%progress%sample, between_checks) > 0) cycle
         call miss_of_ledger(run, miss)
         call check_ledger(instant(run, run%progress), miss, whole_energy(run), error)
         if (allocated(error)) return
      end do
      response%ends_in_contact = run%phase /= phase_free
      response%factorisations = run%stepper%factorisations
      if (allocated(response%energy)) then
         call check_ledger(instant(run, run%progress), miss_of_energies(response), whole_energy(run), error)
         if (allocated(error)) return
      end if
      if (.not. run%keeps_measures) return
      run%measures%final_energy = energy_of(run)
      associate (ledger => run%progress%ledger)
         call finish_steps(run%progress%measurer, instant(run, run%progress), &
            [ledger%dissipated_beam, ledger%dissipated_stop, ledger%dissipated_impact], ledger%created, &
            settings%output%most_peaks, run%measures, response)
      end associate
   end subroutine newmark_response

   !> Can a run start? What would keep it from that is known without running it.
   subroutine check_newmark(model, settings, error)
      type(beam_model_t), intent(in) :: model
      !> Stop, damping, steps, tolerances, output
      type(run_settings_t), intent(in) :: settings
      !> Set when it cannot
      type(failure_t), allocatable, intent(out) :: error

      type(run_t) :: run

      call make_run(model, settings, run, error)
   end subroutine check_newmark

   !> Check the step, make the stepper, the stop and the start.
   subroutine make_run(model, settings, run, error)
      type(beam_model_t), intent(in) :: model
      !> Stop, damping, steps, tolerances, output
      type(run_settings_t), intent(in) :: settings
      !> The run at its start
      type(run_t), intent(out) :: run
      !> Set when the step is too long for the scheme
      type(failure_t), allocatable, intent(out) :: error

      run%settings = settings%stop
      run%sample_step = settings%response%step
      run%contact_tolerance = settings%response%contact_tolerance
      run%release_force = settings%response%release_tolerance/settings%height_ratio
      run%hop_height = max(settings%response%hop_tolerance, settings%response%contact_tolerance)
      run%event_limit = settings%response%event_limit
      run%height_ratio = settings%height_ratio
      call make_yielding_stop(settings%stop, run%stop)
      call divide_step(model, settings%zeta, settings%response, run%parts, error)
      if (allocated(error)) return
      associate (scheme => settings%response)
         call make_newmark_stepper(model, settings%zeta, scheme%newmark_beta, scheme%newmark_gamma, &
            scheme%step/real(run%parts, wp), run%stepper, error)
      end associate
      if (.not. allocated(error)) then
         call make_start_state(model, run%stepper, 1.0_wp + settings%stop%preload, run%states(1), error)
      end if
      if (.not. allocated(error)) call make_factors(run%stepper, 0, error, run%stop)
      if (allocated(error)) then
         call blame_mesh(error)
         return
      end if
      call check_mesh(model, error)
      if (allocated(error)) return
      run%states(2) = run%states(1)
      run%flight_state = run%states(1)
      run%leaving = gap(run, run%states(1)) < -run%contact_tolerance
      if (.not. allocated(run%stop)) return
      if (run%stop%branch_stiffness > 0.0_wp .and. run%stop%relaxation_rate > 0.0_wp) then
         run%contact_level = level_of(run%stepper%step, 1.0_wp/run%stop%relaxation_rate)
      end if
   end subroutine make_run

   !> What a matrix that cannot be factorised tells of a mesh.
   pure subroutine blame_mesh(error)
      !> The message changes
      type(failure_t), intent(inout) :: error

      error%message = "on this mesh Newmark's steps are lost in rounding ("//error%message// &
         "): take elements of more equal length, a shorter step, or method = 'exact'"
   end subroutine blame_mesh

   !> Refuse a step that is too long for a conditionally stable scheme, or divide it if that was asked for.
   pure subroutine divide_step(model, zeta, settings, parts, error)
      type(beam_model_t), intent(in) :: model
      real(wp), intent(in) :: zeta
      !> Step and scheme
      type(response_settings_t), intent(in) :: settings
      !> Number of steps between two samples
      integer, intent(out) :: parts
      !> Set when the step is too long
      type(failure_t), allocatable, intent(out) :: error

      ! close to the limit M* leaves the highest modes hardly any mass, and velocities grow
      real(wp), parameter :: share = 0.5_wp
      real(wp) :: frequency, limit
      ! beyond so many parts the step between two samples is a slip
      real(wp), parameter :: most_parts = 1.0e6_wp
      character(24) :: gamma_text
      character(:), allocatable :: way_out

      parts = 1
      if (settings%newmark_gamma < 0.5_wp) then
         write (gamma_text, '(f24.4)') settings%newmark_gamma
         call fail(error, status_bad_input, 'newmark_gamma must be at least 1/2: with '//trim(adjustl(gamma_text))// &
            ' every step would feed energy into the motion')
         return
      end if
      if (is_unconditionally_stable(settings%newmark_beta, settings%newmark_gamma)) return
      call highest_frequency(model%stiffness, model%mass, model%stop_dof, 0.0_wp, frequency, error)
      if (allocated(error)) return
      limit = critical_step(settings%newmark_beta, settings%newmark_gamma, zeta, frequency/sqrt(lambda1_power4))
      if (settings%step <= limit) return
      if (settings%step >= most_parts*limit) then
         way_out = ' or, with substep = .true., below '//rounded_down(most_parts*limit)//'; shorten it, '
      else if (settings%substep) then
         parts = ceiling(settings%step/(share*limit))
         return
      else
         way_out = '; shorten it, give substep = .true., '
      end if
      call fail(error, status_bad_input, 'step '//to_text(settings%step)// &
         ' is too long for this Newmark scheme: on this '// &
         'mesh it must be at most d tau = '//rounded_down(limit)//way_out// &
         'or take newmark_beta = newmark_gamma / 2 = '//to_text(0.5_wp*settings%newmark_gamma))
   end subroutine divide_step

   !> Refuse a mesh on which rounding alone opens the ledger.
   pure subroutine check_mesh(model, error)
      type(beam_model_t), intent(in) :: model
      !> Set when it does
      type(failure_t), allocatable, intent(out) :: error

      ! a tenth of the bound is mostly seen, and more than 1e-6 must not be
      real(wp), parameter :: most = 1.0e-5_wp
      real(wp) :: share

      call rounding_of_energy(model, share, error)
      if (allocated(error) .or. share <= most) return
      call fail(error, status_bad_input, "on this mesh the energy of Newmark's steps is lost in rounding, up to "// &
         to_text(share)//' of it where at most '//to_text(most)//' is allowed: take fewer elements or elements of '// &
         "more equal length, or method = 'exact'")
   end subroutine check_mesh

   !> Share of the strain energy that rounding may take: eps |y| |K| |y| / (y K y) for the shape at the start. Where
   !> short elements move as rigid bodies, large forces cancel.
   pure subroutine rounding_of_energy(model, share, error)
      type(beam_model_t), intent(in) :: model
      real(wp), intent(out) :: share
      !> Set when the stiffness cannot be factorised
      type(failure_t), allocatable, intent(out) :: error

      type(skyline_t) :: magnitudes
      real(wp), allocatable :: shape(:), forces(:), large_forces(:)

      share = 0.0_wp
      call static_shape(model, shape, error)
      if (allocated(error)) return
      magnitudes = model%stiffness
      magnitudes%values = abs(magnitudes%values)
      allocate (forces(size(shape)), large_forces(size(shape)))
      call multiply(model%stiffness, shape, forces)
      call multiply(magnitudes, abs(shape), large_forces)
      share = epsilon(1.0_wp)*dot_product(abs(shape), large_forces)/abs(dot_product(shape, forces))
   end subroutine rounding_of_energy

   !> The first six digits of a number; what is written is not above it.
   pure function rounded_down(value) result(text)
      !> The number, > 0
      real(wp), intent(in) :: value
      character(:), allocatable :: text

      character(16) :: buffer
      real(wp) :: rounded

      write (buffer, '(es16.5)') value
      read (buffer, *) rounded
      if (rounded > value) write (buffer, '(es16.5)') value*(1.0_wp - 5.0e-6_wp)
      read (buffer, *) rounded
      text = to_text(rounded)
   end function rounded_down

   !> One accepted step and the event it may end with; or the event that no step leads past.
   pure subroutine advance(run, response)
      type(run_t), intent(inout) :: run
      !> Events and counters
      type(response_t), intent(inout) :: response

      integer :: level
      integer(i8) :: span
      logical :: closing
      real(wp) :: energy

      level = run%next_level
      run%next_level = 0
      if (run%progress%offset > 0_i8) level = max(level, deepest_level - trailz(run%progress%offset))
      do
         if (.not. run%stepper%factors(level)%made) then
            call make_factors(run%stepper, level, run%error, run%stop)
            if (allocated(run%error)) return
         end if
         span = shiftr(whole_step, level)
         call try_step(run, level)
         response%evaluations = response%evaluations + 1_i8
         if (is_acceptable(run, level)) exit
         response%rejected = response%rejected + 1_i8
         run%refused_end = run%progress%offset + span
         if (level == deepest_level) then
            call give_way(run, response)
            return
         end if
         level = level + 1
      end do

      run%now = 3 - run%now
      run%progress%offset = run%progress%offset + span
      closing = run%progress%offset < run%refused_end
      if (.not. closing) run%refused_end = nowhere
      if (run%progress%offset == whole_step) then
         run%progress%offset = 0_i8
         run%progress%part = run%progress%part + 1
         if (run%progress%part == run%parts) then
            run%progress%part = 0
            run%progress%sample = run%progress%sample + 1
         end if
      end if
      energy = energy_of(run)
      if (run%keeps_ledger) call account_step(run, run%stepper%factors(level)%step)
      if (run%keeps_measures) call measure_step(run, run%stepper%factors(level)%step, energy)
      if (run%keeps_shapes) then
         call keep_shapes(run%root_dofs, run%states(3 - run%now), run%states(run%now), instant(run, run%progress), &
            run%stepper%factors(level)%step, run%settings%preload, run%progress%next_shape, response)
      end if
      call look_for_event(run, run%stepper%factors(level)%step, closing, response)
   end subroutine advance

   !> Step from the present state into the other place.
   pure subroutine try_step(run, level)
      type(run_t), intent(inout) :: run
      !> How often the step is halved
      integer, intent(in) :: level

      real(wp) :: force, free_displacement, slope, rest

      associate (old => run%states(run%now), new => run%states(3 - run%now), factors => run%stepper%factors(level), &
         stepper => run%stepper, c => run%stepper%stop_dof)
         call predict_step(stepper, level, old, new)
         run%stop_work = 0.0_wp
         select case (run%phase)
         case (phase_free)
            call finish_step(stepper, level, 0.0_wp, new)
            if (old%indentation > 0.0_wp) then
               new%indentation = old%indentation*factors%stop%surface
               new%branch_force = -run%stop%stiffness*new%indentation
            else
               new%indentation = 0.0_wp
               new%branch_force = 0.0_wp
            end if
         case (phase_held)
            force = -new%acceleration(c)/factors%column_at_stop
            call finish_step(stepper, level, force, new)
            ! zero but for rounding
            new%displacement(c) = old%displacement(c)
            new%velocity(c) = 0.0_wp
            new%acceleration(c) = 0.0_wp
         case (phase_contact)
            ! P = slope u + rest in the mean of the step, and u falls with the force at its end through A^-1
            associate (give => 0.25_wp*factors%step**2)
               free_displacement = new%displacement(c) + give*new%acceleration(c)
               call mean_force_coefficients(factors%stop, old%indentation, old%branch_force, slope, rest)
               force = (2.0_wp*(slope*(run%settings%preload + run%contact_gap - free_displacement) + rest) &
                  - old%force) /(1.0_wp + 2.0_wp*slope*give*factors%column_at_stop)
            end associate
            call finish_step(stepper, level, force, new)
            new%indentation = run%settings%preload + run%contact_gap - new%displacement(c)
            new%branch_force = factors%stop%decay*old%branch_force + factors%stop%gain*(new%indentation &
               - old%indentation)
            run%stop_work = (slope*new%indentation + rest)*(new%indentation - old%indentation)
            call change_force(stepper, contact_force(run%stop, new%indentation, new%branch_force), new)
         end select
      end associate
   end subroutine try_step

   !> Does the step in the other place stand? Written so that a NaN does not.
   pure function is_acceptable(run, level) result(stands)
      type(run_t), intent(in) :: run
      !> How often the step was halved
      integer, intent(in) :: level
      logical :: stands

      associate (new => run%states(3 - run%now))
         if (run%phase == phase_free) then
            stands = gap(run, new) >= -run%contact_tolerance .or. (run%leaving .and. gap(run, new) >= -huge(1.0_wp))
            ! at the last level rounding may be all that is missing
            if (.not. stands .and. level == deepest_level) stands = gap(run, new) >= -2.0_wp*run%contact_tolerance
         else
            stands = new%force > 0.0_wp
         end if
      end associate
   end function is_acceptable

   !> What the step just accepted cost.
   pure subroutine account_step(run, step)
      type(run_t), intent(inout) :: run
      real(wp), intent(in) :: step

      real(wp) :: dissipated

      associate (old => run%states(3 - run%now), new => run%states(run%now), ledger => run%progress%ledger)
         call beam_dissipation(run%stepper, step, old, new, dissipated)
         ledger%dissipated_beam = ledger%dissipated_beam + dissipated
         ledger%dissipated_stop = ledger%dissipated_stop + run%stop_work &
            + stop_energy(run, old) - stop_energy(run, new)
      end associate
   end subroutine account_step

   !> Measure the step just accepted.
   pure subroutine measure_step(run, step, energy)
      type(run_t), intent(inout) :: run
      real(wp), intent(in) :: step
      !> Energy at its beginning
      real(wp), intent(in) :: energy

      real(wp) :: from
      type(piece_t) :: piece

      from = instant(run, run%progress) - step
      associate (old => run%states(3 - run%now), new => run%states(run%now), c => run%stepper%stop_dof)
         piece = piece_t(from, step, [old%displacement(c), new%displacement(c)] - run%settings%preload, &
            [old%velocity(c), new%velocity(c)])
         call measure_motion(run%progress%measurer, piece)
         if (run%phase /= phase_free) then
            call measure_contact(run%progress%measurer, from, step, [old%force, new%force])
         end if
         call measure_energy(run%progress%measurer, from, step, [energy, energy_of(run)])
      end associate
   end subroutine measure_step

   !> Energy of beam and stop at the present state: the ledger closes to rounding.
   pure function energy_of(run) result(energy)
      type(run_t), intent(in) :: run
      real(wp) :: energy

      associate (ledger => run%progress%ledger)
         energy = run%progress%measurer%tally%start_energy + ledger%created - ledger%dissipated_beam &
            - ledger%dissipated_stop - ledger%dissipated_impact
      end associate
   end function energy_of

   !> Energy at the start and created.
   pure function whole_energy(run) result(energy)
      type(run_t), intent(in) :: run
      real(wp) :: energy

      energy = run%progress%measurer%tally%start_energy + run%progress%ledger%created
   end function whole_energy

   !> By how much beam and stop miss, at the present state, the energy that the ledger leaves them.
   pure subroutine miss_of_ledger(run, miss)
      !> The run, which keeps its ledger
      type(run_t), intent(inout) :: run
      !> The difference
      real(wp), intent(out) :: miss

      real(wp) :: kinetic, strain

      associate (state => run%states(run%now))
         call kinetic_energy(run%stepper, state, kinetic)
         call strain_energy(run%stepper, state, strain)
         miss = abs(kinetic + strain + stop_energy(run, state) - energy_of(run))
      end associate
   end subroutine miss_of_ledger

   !> Refuse what misses the ledger by more than a share of the energy: rounding has moved the beam.
   pure subroutine check_ledger(tau, miss, whole, error)
      !> The instant
      real(wp), intent(in) :: tau
      !> By how much energy
      real(wp), intent(in) :: miss
      !> Energy at the start and created
      real(wp), intent(in) :: whole
      !> Set when it is too much
      type(failure_t), allocatable, intent(out) :: error

      real(wp), parameter :: tolerance = 1.0e-6_wp

      if (miss <= tolerance*whole) return
      call fail(error, status_run_failed, "Newmark's steps are lost in rounding: by tau = "//to_text(tau)// &
         ' the energy is off by '//to_text(miss/whole)//' of that at the start, and at most '//to_text(tolerance)// &
         " is allowed: take a shorter step, fewer elements or elements of more equal length, or method = 'exact'")
   end subroutine check_ledger

end module newmark_motion
