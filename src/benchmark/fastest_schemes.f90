!> Finds the fastest run within each error bound, separately for each scheme. A scheme is a method of integration with a
!> mass matrix; an entry is a run with one set of settings; errors are differences from the motion that has converged in
!> the mesh.
module fastest_schemes
   use kinds, only: wp
   use precision_types, only: motion_entry_t, varied_mesh
   use scene_types, only: integrator_exact, integrator_names, mass_names
   implicit none (type, external)
   private
   public :: error_bounds, schemes_of, scheme_name, fastest_of, error_contributions

   !> Bounds of the maximum difference of eta from the converged motion of the beam.
   real(wp), parameter :: error_bounds(7) = [1.0e-2_wp, 1.0e-3_wp, 1.0e-4_wp, 1.0e-5_wp, 1.0e-6_wp, 1.0e-7_wp, &
      1.0e-8_wp]

contains

   !> Indices of the first entry of each scheme, among the entries that vary the mesh.
   pure function schemes_of(entries) result(schemes)
      type(motion_entry_t), intent(in) :: entries(:)
      !> Indices into `entries`, [schemes]
      integer, allocatable :: schemes(:)

      integer :: i

      allocate (schemes(0))
      do i = 1, size(entries)
         if (entries(i)%varied /= varied_mesh) cycle
         if (any(is_same_scheme(entries(schemes), entries(i)))) cycle
         schemes = [schemes, i]
      end do
   end function schemes_of

   !> Name of a scheme: method and mass matrix as in scene files.
   pure function scheme_name(entry) result(name)
      type(motion_entry_t), intent(in) :: entry
      character(40) :: name

      name = trim(integrator_names(entry%integrator))//', '//mass_names(entry%mass)
   end function scheme_name

   !> Index of the fastest entry of a scheme whose error is within a bound; 0: there is none. An entry does not qualify
   !> if an entry of the same scheme with at least as many elements and at most the same step exceeds the bound, because
   !> its small error would be due to errors that happen to cancel.
   pure integer function fastest_of(entries, scheme, bound) result(number)
      type(motion_entry_t), intent(in) :: entries(:)
      !> Any entry of the scheme
      type(motion_entry_t), intent(in) :: scheme
      !> Bound of the maximum difference of eta
      real(wp), intent(in) :: bound

      logical, dimension(size(entries)) :: is_of_scheme, exceeds_bound
      integer :: i

      is_of_scheme = is_same_scheme(entries, scheme) .and. entries%varied == varied_mesh .and. entries%failure == ''
      exceeds_bound = is_of_scheme .and. entries%errors%history > bound
      number = minloc(entries%run_time%median, dim=1, mask=is_of_scheme .and. [(.not. any(exceeds_bound .and. &
         entries%elements >= entries(i)%elements .and. entries%step <= entries(i)%step), i=1, size(entries))])
   end function fastest_of

   !> Contributions to the error of a run by Newmark's method, as maximum differences of eta, [3]: error of the time
   !> step (against exact motion on the same mesh), error of the mesh (of exact motion on this mesh), and both together.
   !> Negative: not known.
   pure function error_contributions(entries, number) result(contribution)
      type(motion_entry_t), intent(in) :: entries(:)
      !> Index of an entry that varies the step
      integer, intent(in) :: number
      real(wp) :: contribution(3)

      integer :: i

      contribution = -1.0_wp
      associate (stepped => entries(number))
         if (stepped%failure == '') contribution(1) = stepped%errors%history
         do i = 1, size(entries)
            if (entries(i)%varied /= varied_mesh .or. entries(i)%elements /= stepped%elements .or. &
               entries(i)%mass /= stepped%mass .or. entries(i)%failure /= '') cycle
            if (entries(i)%integrator == integrator_exact) contribution(2) = entries(i)%errors%history
            if (entries(i)%integrator /= stepped%integrator) cycle
            if (.not. abs(entries(i)%step - stepped%step) > 0.0_wp) contribution(3) = entries(i)%errors%history
         end do
      end associate
   end function error_contributions

   !> Whether two entries belong to the same scheme.
   elemental logical function is_same_scheme(one, other) result(answer)
      type(motion_entry_t), intent(in) :: one
      type(motion_entry_t), intent(in) :: other

      answer = one%integrator == other%integrator .and. one%mass == other%mass
   end function is_same_scheme

end module fastest_schemes
