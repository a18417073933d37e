!> What acts on a beam besides its stops: forces, and the inertia that the motion of its base gives it, each as a
!> vector over the degrees of freedom times a course in time.
!>
!> Scales: displacement eta, time tau, mass in rho Abar L, so forces as those of the stops' laws: 3 E Ibar D/L^3 is
!> 3/lambda1^4.
module applied_loads
   use beam_loads, only: base_mass_vector, line_load, point_load
   use beam_model, only: beam_model_t
   use kinds, only: lambda1_power4, wp
   use load_courses, only: acceleration_of
   use load_settings, only: base_displacement, course_harmonic, course_pulse, pulse_half_sine, time_course_t
   use point_forces, only: slow
   use run_settings, only: run_settings_t
   implicit none (type, external)
   private
   public :: applied_loads_t, gather_loads, has_loads, bear_whole, count_forces, courses_of

   !> A mode whose static shape would be so many units of displacement, or move with as many of velocity where a table
   !> rises, is slow, as from there to the surfaces too little would be left of the digits; but not where that makes
   !> more phases than this.
   real(wp), parameter :: most_units = 1.0e2_wp
   real(wp), parameter :: most_phases = 1.0e4_wp

   type :: applied_loads_t
      integer :: count = 0
      !> How each goes on, [loads]
      type(time_course_t), allocatable :: course(:)
      !> Per unit of its course, over the degrees of freedom, [order, loads]
      real(wp), allocatable :: vector(:, :)
      !> The same in the free modes, where they are found, [modes, loads]
      real(wp), allocatable :: mode(:, :)
      !> Frequency with which it swings, 0: it does not, and which of all frequencies that is, [loads]
      real(wp), allocatable :: frequency(:)
      integer, allocatable :: harmonic(:)
      !> Its amplitude goes with which power of its frequency, [loads]
      integer, allocatable :: power(:)
      !> All that differ
      real(wp), allocatable :: frequencies(:)
      !> Modes below this are too slow to come near their static shape, or so far that nothing is left of its digits
      real(wp) :: slow = 0.0_wp
      !> Length of the run
      real(wp) :: duration = 1.0_wp
   end type applied_loads_t

contains

   !> Does anything act on the beam?
   pure function has_loads(settings) result(has)
      type(run_settings_t), intent(in) :: settings
      logical :: has

      has = allocated(settings%forces) .or. allocated(settings%bases)
   end function has_loads

   !> Of all loads so many are forces, which come first; the others move the base.
   pure function count_forces(settings) result(number)
      type(run_settings_t), intent(in) :: settings
      integer :: number

      number = 0
      if (allocated(settings%forces)) number = size(settings%forces)
   end function count_forces

   !> Courses of all loads as they are in the settings.
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

   !> Vectors and courses of all loads.
   pure subroutine gather_loads(model, settings, loads)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      type(applied_loads_t), intent(out) :: loads

      real(wp), allocatable :: vector(:)
      integer :: forces, g, i

      forces = count_forces(settings)
      allocate (loads%course, source=courses_of(settings))
      loads%count = size(loads%course)
      allocate (loads%vector(model%mass%order, loads%count))
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
      loads%slow = max(slow, 1.0_wp/settings%response%duration, &
         min(sqrt(greatest_amplitude(loads)/most_units), most_phases/settings%response%duration))
   end subroutine gather_loads

   !> The greatest value of all courses, or rate.
   pure function greatest_amplitude(loads) result(greatest)
      type(applied_loads_t), intent(in) :: loads
      real(wp) :: greatest

      integer :: g, i

      greatest = 0.0_wp
      do g = 1, loads%count
         associate (course => loads%course(g))
            if (allocated(course%value)) then
               greatest = max(greatest, abs(course%amplitude)*maxval(abs(course%value)))
               do i = 2, size(course%value)
                  greatest = max(greatest, abs(course%amplitude*(course%value(i) - course%value(i - 1)) &
                     /(course%time(i) - course%time(i - 1))))
               end do
            else
               greatest = max(greatest, abs(course%amplitude))
            end if
         end associate
      end do
   end function greatest_amplitude

   !> With which each of them swings.
   pure subroutine find_frequencies(loads)
      type(applied_loads_t), intent(inout) :: loads

      real(wp), parameter :: pi = acos(-1.0_wp)
      integer :: g

      allocate (loads%frequency(loads%count), source=0.0_wp)
      allocate (loads%harmonic(loads%count), source=0)
      allocate (loads%frequencies(0))
      do g = 1, loads%count
         associate (course => loads%course(g))
            if (course%kind == course_harmonic) loads%frequency(g) = course%frequency
            if (course%kind == course_pulse .and. course%shape == pulse_half_sine) then
               loads%frequency(g) = pi/course%duration
            end if
         end associate
         if (loads%frequency(g) <= 0.0_wp) cycle
         loads%harmonic(g) = findloc(abs(loads%frequencies - loads%frequency(g)) <= 0.0_wp, .true., dim=1)
         if (loads%harmonic(g) > 0) cycle
         loads%frequencies = [loads%frequencies, loads%frequency(g)]
         loads%harmonic(g) = size(loads%frequencies)
      end do
   end subroutine find_frequencies

   !> A load that the surfaces which hold the beam take whole moves nothing, and none of them bears a part of it that is
   !> a rounding error: a force that never is any would come and go by its last bits.
   pure subroutine bear_whole(value, mode, share, load)
      !> The free modes at the surfaces, [free, held]
      real(wp), intent(in) :: value(:, :)
      !> The load in the free modes, [free]
      real(wp), intent(in) :: mode(:)
      !> What each surface takes of it, [held]
      real(wp), intent(inout) :: share(:)
      !> The load in the set's modes, [modes]
      real(wp), intent(inout) :: load(:)

      real(wp), parameter :: rounding = 64.0_wp*epsilon(1.0_wp)
      real(wp), dimension(size(mode)) :: left, scale
      integer :: k

      left = mode
      scale = abs(mode)
      do k = 1, size(share)
         left = left - value(:, k)*share(k)
         scale = scale + abs(value(:, k)*share(k))
      end do
      if (any(abs(left) > rounding*scale)) return
      do k = 1, size(share)
         if (norm2(value(:, k)*share(k)) <= rounding*norm2(mode)) share(k) = 0.0_wp
      end do
      load = 0.0_wp
   end subroutine bear_whole

end module applied_loads
