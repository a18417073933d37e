!> Applied loads of a beam: forces, and the inertia forces of a moving base, each as a vector over the degrees of
!> freedom times a time course. Displacements of the beam are relative to the base.
!>
!> Scales: displacements in D (eta), times in tau, masses in rho Abar L, so forces in lambda1^4 E Ibar D/L^3. The unit
!> of forces in settings, 3 E Ibar D/L^3, is 3/lambda1^4 of this unit.
module applied_loads
   use beam_loads, only: base_mass_vector, line_load, point_load
   use beam_model, only: beam_model_t
   use kinds, only: lambda1_power4, wp
   use load_courses, only: acceleration_of, frequency_of
   use load_settings, only: base_displacement, course_harmonic, course_pulse, time_course_t
   use point_forces, only: slow_frequency
   use run_settings, only: run_settings_t
   implicit none (type, external)
   private
   public :: applied_loads_t, gather_loads, are_mergeable, merge_loads, has_loads, drop_balanced, count_forces, &
      courses_of, largest_value, largest_slope, are_slow, is_slow_load

   !> A mode is slow if its static displacement under the loads, estimated as their maximum amplitude over W^2, exceeds
   !> this number of units of displacement, or its quasi-static velocity under the slopes of a table, estimated
   !> likewise, this number per unit of tau: gaps computed relative to such a response would lose too many digits.
   real(wp), parameter :: max_units = 1.0e3_wp
   !> A harmonic load drives slow modes from rest only if its frequency times the time for which it is active is less
   !> than this value, because phases then end after two periods of the load (docs/theory.md, section 18).
   real(wp), parameter :: max_phases = 1.0e4_wp

   !> All loads of a run, the forces first and then the base motions.
   type :: applied_loads_t
      !> Number of loads
      integer :: count = 0
      !> Time course of each load, [loads]
      type(time_course_t), allocatable :: course(:)
      !> Load vectors over the degrees of freedom per unit of the time course, [order of the model, loads]
      real(wp), allocatable :: vector(:, :)
      !> Modal loads of the free modes per unit of the time course; unallocated: the modes are not known yet, [modes,
      !> loads]
      real(wp), allocatable :: mode(:, :)
      !> Circular frequency of a harmonic or half-sine load, 0 for others, [loads]
      real(wp), allocatable :: frequency(:)
      !> Index of that frequency in `frequencies`; 0: the load has no frequency, [loads]
      integer, allocatable :: harmonic(:)
      !> The amplitude of the load is proportional to this power of its frequency: 2 for the acceleration of a base
      !> whose displacement is harmonic, else 0, [loads]
      integer, allocatable :: power(:)
      !> All distinct frequencies of harmonic and half-sine loads
      real(wp), allocatable :: frequencies(:)
      !> Modes below this frequency are treated as slow (`are_slow`): such a mode does not reach its static displacement
      !> or this is too large for the precision of the gaps
      real(wp) :: slow = 0.0_wp
      !> Length of the run, tau
      real(wp) :: duration = 1.0_wp
   end type applied_loads_t

contains

   !> Whether the run has applied loads.
   pure logical function has_loads(settings) result(answer)
      type(run_settings_t), intent(in) :: settings

      answer = allocated(settings%forces) .or. allocated(settings%bases)
   end function has_loads

   !> Number of forces, which precede the base motions among all loads.
   pure integer function count_forces(settings) result(number)
      type(run_settings_t), intent(in) :: settings

      number = 0
      if (allocated(settings%forces)) number = size(settings%forces)
   end function count_forces

   !> Time courses of all loads as in the settings.
   pure function courses_of(settings) result(courses)
      type(run_settings_t), intent(in) :: settings
      type(time_course_t), allocatable :: courses(:)

      integer :: bases, forces

      forces = count_forces(settings)
      bases = 0
      if (allocated(settings%bases)) bases = size(settings%bases)
      allocate (courses(forces + bases))
      if (forces > 0) courses(:forces) = settings%forces%course
      if (bases > 0) courses(forces + 1:) = settings%bases%course
   end function courses_of

   !> Load vectors and time courses of all loads. The time course of a base motion is the acceleration of the base.
   pure subroutine gather_loads(model, settings, loads)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      type(applied_loads_t), intent(out) :: loads

      real(wp), allocatable :: vector(:)
      ! maximum magnitude of all time courses and of the slopes of tables, a measure of the modal forces
      real(wp) :: largest
      integer :: forces, g, i

      forces = count_forces(settings)
      allocate (loads%course, source=courses_of(settings))
      loads%count = size(loads%course)
      allocate (loads%vector(model%mass%order, loads%count), source=0.0_wp)
      do g = 1, forces
         associate (force => settings%forces(g))
            if (allocated(force%position)) then
               allocate (vector(model%mass%order), source=0.0_wp)
               do i = 1, size(force%position)
                  vector = vector + point_load(model, force%position(i))
               end do
            else
               allocate (vector, source=line_load(model, force%stretch(1), force%stretch(2)))
            end if
         end associate
         loads%vector(:, g) = 3.0_wp/lambda1_power4*vector
         deallocate (vector)
      end do
      allocate (loads%power(loads%count), source=0)
      do g = forces + 1, loads%count
         associate (base => settings%bases(g - forces))
            loads%course(g) = acceleration_of(base)
            if (base%quantity == base_displacement .and. base%course%kind == course_harmonic) loads%power(g) = 2
         end associate
         loads%vector(:, g) = -base_mass_vector(model)
      end do
      call find_frequencies(loads)
      loads%duration = settings%response%duration
      largest = maxval([0.0_wp, largest_value(loads%course), largest_slope(loads%course)])
      loads%slow = max(slow_frequency, 1.0_wp/settings%response%duration, sqrt(largest/max_units))
   end subroutine gather_loads

   !> Whether loads may be merged: bending moments (`&stress`) are evaluated with single forces, and derivatives with
   !> respect to an amplitude (`&poincare`) refer to a single load.
   pure logical function are_mergeable(settings) result(answer)
      type(run_settings_t), intent(in) :: settings

      answer = .not. (allocated(settings%stress) .or. allocated(settings%poincare))
   end function are_mergeable

   !> Merge loads whose time courses differ only by a factor: the work of a phase grows with the number of loads.
   pure subroutine merge_loads(loads)
      !> Its modal loads are not known yet
      type(applied_loads_t), intent(inout) :: loads

      integer :: g, h, remaining

      remaining = 0
      do g = 1, loads%count
         do h = 1, remaining
            if (loads%power(g) == loads%power(h) .and. is_proportional(loads%course(g), loads%course(h))) exit
         end do
         if (h <= remaining) then
            loads%vector(:, h) = loads%vector(:, h) &
               + loads%course(g)%amplitude/loads%course(h)%amplitude*loads%vector(:, g)
            cycle
         end if
         remaining = h
         loads%course(remaining) = loads%course(g)
         loads%vector(:, remaining) = loads%vector(:, g)
         loads%power(remaining) = loads%power(g)
         loads%frequency(remaining) = loads%frequency(g)
         loads%harmonic(remaining) = loads%harmonic(g)
      end do
      loads%count = remaining
      loads%course = loads%course(:remaining)
      loads%vector = loads%vector(:, :remaining)
      loads%power = loads%power(:remaining)
      loads%frequency = loads%frequency(:remaining)
      loads%harmonic = loads%harmonic(:remaining)
   end subroutine merge_loads

   !> Whether a time course is a multiple of another one: all parameters but the amplitude are exactly equal. Tables are
   !> not compared.
   pure logical function is_proportional(course, other) result(answer)
      type(time_course_t), intent(in) :: course
      type(time_course_t), intent(in) :: other

      answer = course%kind == other%kind .and. course%shape == other%shape .and. abs(other%amplitude) > 0.0_wp &
         .and. .not. (allocated(course%time) .or. allocated(other%time))
      answer = answer .and. all(abs([course%frequency - other%frequency, course%phase - other%phase, &
         course%start - other%start, course%end - other%end, course%duration - other%duration]) <= 0.0_wp)
   end function is_proportional

   !> Whether modes are slow. The quasi-static displacement under a slope has a constant in proportion to the damping
   !> coefficient, which may be large although the static displacement is not.
   pure function are_slow(loads, square, damping) result(answer)
      type(applied_loads_t), intent(in) :: loads
      !> W^2, [modes]
      real(wp), intent(in) :: square(:)
      !> 2 zeta W^2 + alpha, [modes]
      real(wp), intent(in) :: damping(:)
      logical :: answer(size(square))

      answer = sqrt(square) < loads%slow .or. maxval(largest_slope(loads%course))*damping > max_units*square**2
   end function are_slow

   !> Whether slow modes are driven from rest by a harmonic load: its frequency is low, and it has few periods.
   pure logical function is_slow_load(loads, load) result(answer)
      type(applied_loads_t), intent(in) :: loads
      !> Index of the load
      integer, intent(in) :: load

      real(wp) :: active

      associate (course => loads%course(load))
         active = min(course%end, loads%duration) - course%start
         if (course%kind == course_pulse) active = min(active, course%duration)
         answer = loads%frequency(load) < loads%slow .and. (loads%frequency(load) < slow_frequency .or. &
            loads%frequency(load)*active < max_phases)
      end associate
   end function is_slow_load

   !> Maximum magnitude of a time course.
   elemental real(wp) function largest_value(course) result(maximum)
      type(time_course_t), intent(in) :: course

      maximum = abs(course%amplitude)
      if (allocated(course%value)) maximum = maximum*maxval(abs(course%value))
   end function largest_value

   !> Maximum magnitude of the slopes of a table; 0 for other time courses.
   elemental real(wp) function largest_slope(course) result(maximum)
      type(time_course_t), intent(in) :: course

      maximum = 0.0_wp
      if (.not. allocated(course%value)) return
      associate (n => size(course%value))
         maximum = maxval([0.0_wp, abs(course%amplitude*(course%value(2:) - course%value(:n - 1)) &
            /(course%time(2:) - course%time(:n - 1)))])
      end associate
   end function largest_slope

   !> Frequencies of the harmonic and half-sine loads.
   pure subroutine find_frequencies(loads)
      type(applied_loads_t), intent(inout) :: loads

      integer :: g

      allocate (loads%frequency, source=frequency_of(loads%course))
      allocate (loads%harmonic(loads%count), source=0)
      allocate (loads%frequencies(0))
      do g = 1, loads%count
         if (loads%frequency(g) <= 0.0_wp) cycle
         loads%harmonic(g) = findloc(abs(loads%frequencies - loads%frequency(g)) <= 0.0_wp, .true., dim=1)
         if (loads%harmonic(g) > 0) cycle
         loads%frequencies = [loads%frequencies, loads%frequency(g)]
         loads%harmonic(g) = size(loads%frequencies)
      end do
   end subroutine find_frequencies

   !> Remove rounding errors from a load that the closed rigid contacts balance entirely: the load in the constrained
   !> modes becomes zero, and so does the force at each contact that is a rounding error. Otherwise the last bits of a
   !> zero force would decide when contacts open and close.
   pure subroutine drop_balanced(value, mode, equivalent_force, load)
      !> Values of the free modes at the closed contacts, [free, closed]
      real(wp), intent(in) :: value(:, :)
      !> The load in the free modes, [free]
      real(wp), intent(in) :: mode(:)
      !> Forces at the contacts with the effect of a unit of the load; their opposites balance this unit, [closed]
      real(wp), intent(inout) :: equivalent_force(:)
      !> The load in the constrained modes, [modes]
      real(wp), intent(inout) :: load(:)

      real(wp), parameter :: rounding = 64.0_wp*epsilon(1.0_wp)
      real(wp), dimension(size(mode)) :: remainder, scale
      integer :: k

      remainder = mode
      scale = abs(mode)
      do k = 1, size(equivalent_force)
         remainder = remainder - value(:, k)*equivalent_force(k)
         scale = scale + abs(value(:, k)*equivalent_force(k))
      end do
      if (any(abs(remainder) > rounding*scale)) return
      do k = 1, size(equivalent_force)
         if (norm2(value(:, k)*equivalent_force(k)) <= rounding*norm2(mode)) equivalent_force(k) = 0.0_wp
      end do
      load = 0.0_wp
   end subroutine drop_balanced

end module applied_loads
